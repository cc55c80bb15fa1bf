// Statistics of the errors at sets of several contacts, by kind of set.
#pragma once

#include <vector>

#include "offline/precompute/contact_sets.hpp"
#include "offline/precompute/error_survey.hpp"

namespace palpate {

// A model's response to one set.
struct SetAnswer {
  SetKind kind = SetKind::two_near;
  bool is_solved = false;         // an equilibrium exists
  bool is_flagged = false;        // the response carries a warning flag
  double displacement_error = 1;  // as SetErrors in schemas/pack.fbs; 1 without an equilibrium
  double force_error = 1;
  // Two sizes of the set (ErrorSurvey in schemas/pack.fbs): `load` by the net forces, `reach` by |d|.
  double load = 1;
  double reach = 1;

  // Whether the errors enter the statistics: an unsolved set has errors of 1, unless the response has a flag.
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

// Bounds of 95 % of unflagged errors, relative to a size of the set; 0 without responses.
struct SetBounds {
  double displacement = 0;
  double force = 0;
};

struct SetSurvey {
  std::vector<SetKindErrors> kinds;  // kinds with at least one set
  // Bounds of error / load and error / reach, for the runtime's estimate. Opposed neighbours have a large
  // load. Contacts that move far strain the exterior and have a large reach.
  SetBounds over_load;
  SetBounds over_reach;
};

// Groups the responses by kind and bounds their errors.
SetSurvey tabulate_sets(const std::vector<SetAnswer>& answers);

}  // namespace palpate
