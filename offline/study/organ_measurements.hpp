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

// Microseconds of single frames. `lowest` and `highest` are the extreme medians of the timing rounds.
struct TimeSummary {
  double median = 0;
  double p99 = 0;
  double p999 = 0;
  double max = 0;
  double lowest = 0;
  double highest = 0;
};

// Kinds of methods, in the order of a legend.
enum class MethodKind { linear, polynomial, zone, newton };
inline constexpr size_t kMethodKinds = 4;

// Errors and times of one method at one |d|.
struct MethodRow {
  MethodKind kind = MethodKind::linear;
  std::string name;  // "polynomial_dd, degree 5, rank 20, int16"
  int contacts = 1;
  double part = 1;                         // fraction of the pack's largest |d|
  int pushes = 0;                          // pushes behind the errors
  ErrorSummary displacement;               // max over shown nodes |u - u_FE| / |d|
  ErrorSummary force;                      // |f - f_FE| / |f_FE|, |f_FE| floored at 5 % of the largest force
  ErrorSummary force_unfloored;            // the same without the floor
  ErrorSummary displacement_off;           // |u - u_FE|, length unit
  ErrorSummary force_off;                  // |f - f_FE|, force unit
  TimeSummary haptic;                      // forces and stiffness
  TimeSummary visual;                      // displacements of all shown nodes
  std::optional<TimeSummary> haptic_cold;  // empty: not measured
  std::optional<TimeSummary> visual_cold;
};

// One method's response to one push.
struct PushRow {
  std::string set;   // "random", "levels" or "several"
  int push = 0;      // number within the set
  std::string name;  // name of the method
  MethodKind kind = MethodKind::linear;
  int contacts = 1;
  std::string sites;                                 // labels, joined by ';'
  std::vector<std::array<double, 3>> displacements;  // for each contact; length unit
  double size = 0;                                   // largest |d| of the contacts; length unit
  double part = 0;                                   // fraction of the pack's largest |d|
  std::optional<double> strain;   // |d| / thickness of the organ along d; single contacts only
  bool solved = true;             // false: the push has no equilibrium, and errors are 1
  double displacement_error = 1;  // this and the next four: as in MethodRow, for this push
  double force_error = 1;
  double force_error_unfloored = 1;
  double displacement_off = 0;
  double force_off = 0;
  std::optional<double> displacement_estimate;  // the runtime's error estimate; empty: none given
  std::optional<double> force_estimate;
};

// Survey validation of a model: errors claimed by the pack, and found at new pushes. Errors are fractions.
struct ValidationRow {
  std::string model;
  int pushes = 0;
  double claimed_displacement_p95 = 0;
  double found_displacement_p95 = 0;
  double claimed_force_p95 = 0;
  double found_force_p95 = 0;
  double displacement_coverage = 0;  // fraction of the pushes within the runtime's estimate
  double force_coverage = 0;
  bool kept = true;  // the errors found agree with the claim
};

// A memcpy of the bytes that a field reads.
struct FieldCopy {
  double kilobytes = 0;
  TimeSummary copy;
};

struct OrganReport {
  std::string name;         // stem of the organ's file names
  std::string title;        // "brain"
  std::string source;       // path of the pack or scene
  std::string length_unit;  // "" where the scene states no unit
  std::string force_unit;
  double metres_per_length_unit = 1;
  double newtons_per_force_unit = 1;
  int nodes = 0;
  int elements = 0;
  int shown_nodes = 0;
  int sites = 0;
  int sites_compared = 0;  // sites at which the methods are compared
  double pack_megabytes = 0;
  double mean_edge = 0;         // h; length unit
  double max_displacement = 0;  // length unit
  double thickness = 0;         // median thickness of the organ under its sites; length unit; 0: unknown
  int max_contacts = 1;
  int unsolved = 0;                     // pushes without an equilibrium
  std::vector<ValidationRow> promises;  // one for each model
  std::vector<MethodRow> methods;
  std::vector<PushRow> pushes;
  std::optional<FieldCopy> smallest_copy;  // of the model whose field reads least
  std::vector<std::string> notes;          // omitted comparisons, with the reason
  std::filesystem::path error_map;         // PNG; empty: none
  bool is_kept() const {
    for (const ValidationRow& validation : promises) {
      if (!validation.kept) return false;
    }
    return true;
  }
};

}  // namespace palpate
