// Frames of one set of contacts by every method: each gives the displacement of every node and the contacts'
// forces.
#pragma once

#include <string>
#include <vector>

#include "bench/peers/linear_organ.hpp"

namespace palpate::peers {

constexpr double kLcgTolerance = 1e-3;  // of LCG: about what the eye sees

struct MethodFrames {
  std::string method;
  double ready_seconds = 0;  // what is made beforehand
  FrameTimes times;
  Errors errors;
  int iterations = 0;  // median; 0: it does not iterate
};

// What the contacts do: each goes round a circle, by 2 % of its radius a frame, about a point below.
enum class Motion { each_its_own, as_one };

struct Effort {
  double seconds = 0.25;    // for the frames of one method,
  int least_frames = 5;     // but no fewer than this
  int most_frames = 10000;  // and no more than that
  bool from_rest = false;   // CG from rest too
};

// By linear_dd (forces and field; forces alone), PFE, a back-solve, LCG, LCG with block-Jacobi and CG from
// rest. Errors are those of three more frames after all that are timed; the back-solve's are taken as 0. The
// organ shows all its free nodes.
std::vector<MethodFrames> measure_methods(const LinearOrgan& organ, const std::vector<std::uint32_t>& sites,
                                          Motion motion, double amplitude, const Effort& effort);

inline std::string error_cell(double error) {
  return error > 0 ? fmt::format("{:.1e}", error) : "the reference";
}

// Displacements of the contacts in a frame, three numbers each.
Eigen::VectorXd circling(int frame, size_t num_contacts, Motion motion, double amplitude);

}  // namespace palpate::peers
