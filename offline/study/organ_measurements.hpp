// The measurements of one organ that a report shows: plain numbers.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

struct ErrorSummary {
  double median = 0;
  double p95 = 0;
  double max = 0;
};

// Microseconds of single frames. `lowest` and `highest`: medians of the rounds that the frames were timed in, what a
// second run may be expected between.
struct TimeSummary {
  double median = 0;
  double p99 = 0;
  double p999 = 0;
  double max = 0;
  double lowest = 0;
  double highest = 0;
};

// Kinds of methods, in the order in which a legend has them.
enum class MethodKind {
  linear,
  polynomial,
  moved,  // a polynomial, from another site
  zone,
  fixed_tensor,
  back_solve,
  localized_cg,
  elsewhere,  // measured by something else, other software for one
  newton
};
inline constexpr size_t kMethodKinds = 9;

// One method, asked at one |d|.
struct MethodRow {
  MethodKind kind = MethodKind::linear;
  std::string name;      // "polynomial_dd, degree 5, rank 20, int16"
  bool carried = false;  // by the pack that the report is about; else another setting, for comparison
  int contacts = 1;
  double part = 1;                         // of the pack's largest |d|
  int pushes = 0;                          // that its errors are of,
  int diverged = 0;                        //   those without an answer among them: errors as of a zero one
  ErrorSummary displacement;               // max over shown nodes |u - u_FE| / |d|
  ErrorSummary force;                      // |f - f_FE| / |f_FE|, |f_FE| floored at 5 % of the largest
  ErrorSummary force_unfloored;            // the same without a floor
  ErrorSummary displacement_off;           // |u - u_FE|, length unit
  ErrorSummary force_off;                  // |f - f_FE|, force unit
  TimeSummary haptic;                      // forces and stiffness
  TimeSummary visual;                      // displacements of all shown nodes
  std::optional<TimeSummary> haptic_cold;  // none: not measured
  std::optional<TimeSummary> visual_cold;
};

// One push and one method's answer to it.
struct PushRow {
  std::string set;  // "random", "levels" or "several"
  int push = 0;     // of the set
  std::string name;
  MethodKind kind = MethodKind::linear;
  bool carried = false;
  int contacts = 1;
  std::string sites;                                 // labels, joined by ';'
  std::vector<std::array<double, 3>> displacements;  // of each contact; length unit
  double size = 0;                                   // the largest |d| of the contacts; length unit
  double part = 0;                                   // of the pack's largest
  std::optional<double> strain;                      // |d| / thickness of the organ along d; one contact
  bool solved = true;                                // false: there is no truth, and errors are 1
  double displacement_error = 1;
  double force_error = 1;
  double force_error_unfloored = 1;
  double displacement_off = 0;
  double force_off = 0;
  std::optional<double> displacement_estimate;  // what the runtime estimated; none: no runtime answered
  std::optional<double> force_estimate;
};

// What the pack says of a model, and what was found.
struct PromiseRow {
  std::string model;
  int pushes = 0;
  double claimed_displacement_p95 = 0;
  double found_displacement_p95 = 0;
  double claimed_force_p95 = 0;
  double found_force_p95 = 0;
  double displacement_coverage = 0;  // part of the pushes within the runtime's estimate
  double force_coverage = 0;
  bool kept = true;
};

// A copy of as many bytes as a method's field reads.
struct CopyRow {
  std::string method;
  double kilobytes = 0;
  TimeSummary copy;
};

struct OrganReport {
  std::string name;         // of its files
  std::string title;        // "brain"
  std::string source;       // of the pack or scene, as given
  std::string length_unit;  // "" where the scene states none
  std::string force_unit;
  double metres_per_length_unit = 1;
  double newtons_per_force_unit = 1;
  int nodes = 0;
  int elements = 0;
  int shown_nodes = 0;
  int sites = 0;
  int sites_compared = 0;  // where methods are compared
  double pack_megabytes = 0;
  double mean_edge = 0;         // h; length unit
  double max_displacement = 0;  // length unit
  double thickness = 0;         // of the organ under its sites, the median; length unit; 0: unknown
  int max_contacts = 1;
  int unsolved = 0;  // pushes without an equilibrium
  std::vector<PromiseRow> promises;
  std::vector<MethodRow> methods;
  std::vector<PushRow> pushes;
  std::vector<CopyRow> copies;
  std::vector<std::string> notes;  // what could not be compared, and why
  // What is to be known of methods that something else has measured.
  std::vector<std::string> captions_elsewhere;
  std::filesystem::path error_map;  // PNG; empty: none
  bool is_kept() const {
    for (const PromiseRow& promise : promises) {
      if (!promise.kept) return false;
    }
    return true;
  }
};

}  // namespace palpate
