// Frames of a contact set by every method, with all nodal displacements and the contacts' forces.
#pragma once

#include <string>
#include <vector>

#include "bench/peers/linear_organ.hpp"

namespace palpate::peers {

constexpr double kLcgTolerance = 1e-3;  // tolerance of LCG, about the visible limit

struct MethodFrames {
  std::string method;
  double preparation_seconds = 0;  // time before the first frame
  FrameTimes times;
  Errors errors;
  int iterations = 0;  // median; 0 for direct methods
};

// Motion of the contacts: each circles about a point below, by 2 % of its radius a frame. `as_one`: all
// contacts have the same displacement; `each_its_own`: their phases differ.
enum class Motion { each_its_own, as_one };

struct Effort {
  double seconds = 0.25;    // time for a method's frames
  int least_frames = 5;     // but at least so many frames
  int most_frames = 10000;  // and at most so many frames
  bool from_rest = false;   // also time CG from rest
};

// Measures linear_dd (forces and field; forces alone), PFE, back-solve, LCG, LCG with block-Jacobi, and CG
// from rest on request. Errors come from three more frames after the timing; the back-solve counts as exact.
// The organ packs all free nodes.
std::vector<MethodFrames> measure_methods(const LinearOrgan& organ, const std::vector<std::uint32_t>& sites,
                                          Motion motion, double amplitude, const Effort& effort);

inline std::string error_cell(double error) {
  return error > 0 ? fmt::format("{:.1e}", error) : "the reference";
}

// Returns the displacements of the contacts in a frame, three numbers a contact.
Eigen::VectorXd circling(int frame, size_t num_contacts, Motion motion, double amplitude);

}  // namespace palpate::peers
