// Measures the error of a method (a runtime model, or a method in comparison) push by push.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/precompute/error_survey.hpp"

namespace palpate {

// A method's response to a set of contacts; lengths and forces in model units.
struct MethodAnswer {
  Eigen::VectorXd field;                // from rest, 3 packed nodes
  std::vector<Eigen::Vector3d> forces;  // one for each contact
  // Error estimate of the runtime, largest over the contacts; 0: not estimated.
  double displacement_estimate = 0;
  double force_estimate = 0;
  std::uint32_t flags = 0;  // PAL_FLAG_... of all contacts together
};
using Method = std::function<MethodAnswer(const std::vector<LinearContact>& contacts)>;

struct MeasuredPush {
  // Largest over packed nodes: |u - u_FE| / |d|, with the largest |d| of the contacts.
  double displacement_error = 1;
  // Largest over the contacts: |f - f_FE| / |f_FE|, |f_FE| floored at 5 % of the largest force of all truths.
  double force_error = 1;
  double force_error_unfloored = 1;  // the same without the floor
  double displacement_off = 0;       // largest |u - u_FE|: length unit
  double force_off = 0;              // largest |f - f_FE|: force unit
  double displacement_estimate = 0;
  double force_estimate = 0;
};

// Returns runtime contacts at the fraction `part` of their displacements. `sites`: pack site of each site.
std::vector<pal_contact> contacts_at(const std::vector<LinearContact>& contacts,
                                     const std::vector<std::uint32_t>& sites, double part);

// Converts results of the runtime. `field`: from rest, 3 packed nodes.
MethodAnswer answer_of(const std::vector<pal_contact_result>& results, const Eigen::VectorXd& field);

// Converts survey samples to truths with one contact.
std::vector<ContactTruth> truths_of(std::vector<SurveySample> samples);

// Returns the largest force of any contact.
double largest_force(const std::vector<ContactTruth>& truths);

// Compares a response with a solved truth. `floor`: the least |f_FE| in the denominator. `worst`: see below.
MeasuredPush measure_push(const ContactTruth& truth, const MethodAnswer& answer, double floor,
                          std::vector<double>* worst = nullptr);

// Compares responses with all truths; an unsolved truth gives default values. `worst` (may be null) gets the
// largest |u - u_FE| / |d| of each packed node.
std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths, const Method& method,
                                         std::vector<double>* worst = nullptr);

// Runs the comparison on `jobs` threads. Each site has its own method: digits do not depend on threads. Any
// thread may call `make_method`, whose methods share no session. `progress` gets done and total sites.
std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths,
                                         const std::function<Method()>& make_method, int jobs,
                                         const std::function<void(int, int)>& progress = {},
                                         std::vector<double>* worst = nullptr);

// Returns a method that calls session.settle() and must not outlive `session`. `sites`: as in contacts_at().
Method runtime_method(ModelUnitSession& session, std::vector<std::uint32_t> sites);

// Returns a method with a session of its own. Contacts name sites of the pack.
Method runtime_method(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                      std::uint32_t zone_rings = 0, bool refines = true);

}  // namespace palpate
