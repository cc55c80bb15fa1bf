#include "offline/fem/load_case.hpp"

namespace palpate {

LoadCase LoadCase::rest(const Model& model) {
  LoadCase load;
  load.held = model.fixed_dofs();
  load.displacement.setZero(model.num_dofs());
  load.force.setZero(model.num_dofs());
  return load;
}

}  // namespace palpate
