// How wrong an answer to contacts is, push by push.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/precompute/error_survey.hpp"

namespace palpate {

// What a method says to a set of contacts; lengths and forces in the model's units.
struct MethodAnswer {
  Eigen::VectorXd field;                // from rest, 3 packed nodes
  std::vector<Eigen::Vector3d> forces;  // of each contact
  double displacement_estimate =
      0;  // the largest of the contacts', as the runtime gives them; 0 where it did not
  double force_estimate = 0;
  std::uint32_t flags = 0;  // PAL_FLAG_... of any contact
};
using Method = std::function<MethodAnswer(const std::vector<LinearContact>& contacts)>;

struct MeasuredPush {
  double displacement_error = 1;  // max over packed nodes |u - u_FE| / |d|, the largest |d| of the contacts
  double force_error = 1;         // the largest over the contacts: |f - f_FE| / |f_FE|, |f_FE| floored
  double force_error_unfloored = 1;  //   at 5 % of the largest of all truths; and not floored
  double displacement_off = 0;       // length unit
  double force_off = 0;              // force unit
  double displacement_estimate = 0;
  double force_estimate = 0;
};

// Pushes of one contact.
std::vector<ContactTruth> truths_of(std::vector<SurveySample> samples);

// The largest of any contact.
double largest_force(const std::vector<ContactTruth>& truths);

// Of a truth that was solved. `floor`: no |f_FE| counts as less. `worst` (null: not wanted) as below.
MeasuredPush measure_push(const ContactTruth& truth, const MethodAnswer& answer, double floor,
                          std::vector<double>* worst = nullptr);

// Of each truth; where there is none its defaults. `worst` (null: not wanted) gets the largest |u - u_FE| / |d| of each
// packed node.
std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths, const Method& method,
                                         std::vector<double>* worst = nullptr);

// The same on `jobs` threads, the pushes of each site by a method of their own, so that no digit depends on the
// threads. `make_method` is called by any of them, and no two of its methods share a session. `progress` gets sites
// done and their number.
std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths,
                                         const std::function<Method()>& make_method, int jobs,
                                         const std::function<void(int, int)>& progress = {},
                                         std::vector<double>* worst = nullptr);

// The runtime's answer from rest, by a session that outlives it. `sites`: the pack's number of each site that
// contacts name.
Method runtime_method(ModelUnitSession& session, std::vector<std::uint32_t> sites);

// The same, by a session of its own (ModelUnitSession), and of the pack's sites.
Method runtime_method(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                      std::uint32_t zone_rings = 0);

// The same, but of contacts that come straight from rest in so many frames: what they are told in the frame in which
// they arrive, however far a model that iterates has got by then.
Method moving_method(ModelUnitSession& session, std::vector<std::uint32_t> sites, int frames);

}  // namespace palpate
