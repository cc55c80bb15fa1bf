// How wrong answers to sets of several contacts are, by kind of set.
#pragma once

#include <vector>

#include "offline/precompute/contact_sets.hpp"
#include "offline/precompute/error_survey.hpp"

namespace palpate {

// What a model said to one set.
struct SetAnswer {
  SetKind kind = SetKind::two_near;
  bool is_solved = false;         // an equilibrium was found
  bool is_flagged = false;        // and the answer says that it may be wrong
  double displacement_error = 1;  // as SetErrors in schemas/pack.fbs; 1 where no equilibrium was found
  double force_error = 1;
  double load = 1;  // of the set, as the runtime has them (ErrorSurvey in schemas/pack.fbs)
  double reach = 1;

  // Whether its errors do: an answer to what has no equilibrium is wrong, unless it says so.
  bool counts() const { return is_solved || !is_flagged; }
};

struct SetKindErrors {
  SetKind kind = SetKind::two_near;
  int sets = 0;
  int unsolved = 0;
  int flagged = 0;
  ErrorFigures displacement;
  ErrorFigures force;
};

struct SetSurvey {
  std::vector<SetKindErrors> kinds;  // those of which there are sets
  // Errors over loads, and over reaches, that cover 95 % of those without a flag; 0 where there are none, or nothing is
  // estimated from them. The first knows what neighbours do that move against each other. The second knows what the organ
  // outside of zones leaves, which grows as the square of how far contacts go and with their number: where all go to the
  // end of the scene the first covers 77, 98, 92 and 90 of 100 on the brain (nu = 0.4 to 2 h and to 1 h, 0.49, 0.45 with one
  // ring), both together 99 to 100.
  double displacement_bound = 0;
  double force_bound = 0;
  double displacement_reach_bound = 0;
  double force_reach_bound = 0;
};

SetSurvey tabulate_sets(const std::vector<SetAnswer>& answers);

}  // namespace palpate
