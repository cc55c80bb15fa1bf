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

// What covers 95 % of errors without a flag, each over a size of its set; 0 where there are none.
struct SetBounds {
  double displacement = 0;
  double force = 0;
};

struct SetSurvey {
  std::vector<SetKindErrors> kinds;  // those of which there are sets
  // What a runtime estimates from: what neighbours do that move against each other shows in loads, what the organ
  // outside of zones leaves where all contacts go far in reaches alone.
  SetBounds over_load;
  SetBounds over_reach;
};

SetSurvey tabulate_sets(const std::vector<SetAnswer>& answers);

}  // namespace palpate
