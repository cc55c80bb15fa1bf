// Single against double precision: fields packed in float32, and nearly vanishing displacements.
#include <fmt/core.h>

#include "offline/precompute/linear_contacts.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

constexpr double kMostOfPrecision = 0.1;

// linear_dd of the runtime, fields in float32, compared with back-solves in double.
std::vector<Answer> linear_fields(const std::string& name, const std::function<Model()>& model, double size) {
  const Organ& organ = shared_organ("precision " + name, [&] {
    OrganSpec spec = touched(model(), kMostOfPrecision, 0.2);
    spec.sites.resize(4);
    spec.polynomial = false;
    spec.survey_samples = 4;
    return spec;
  });
  const Assembly assembly(organ.model(), organ.model().fixed_dofs());
  StaticSolver solver(assembly);
  factor_at_rest(solver);
  const Eigen::Vector3d d(0.3 * size, -0.2 * size, -0.9 * size);
  const Eigen::Vector3d other(0, 0.5 * size, 0.5 * size);
  Truth truth;
  const LinearContactAnswer exact = solve_contacts(solver, organ.sites(), {{0, d}, {3, other}});
  truth.solved = true;
  truth.field = exact.field;
  truth.forces = exact.forces;
  return {organ.ask(PAL_MODEL_LINEAR, {push(0, d), push(3, other)}, truth)};
}

// A push in the linear range: every model is compared with linear_dd's response, which scales. Errors are
// relative to the push or, if larger, to 1e-9 of the domain.
std::vector<Answer> tiny(double size, FieldPrecision precision) {
  const bool rounded = precision == FieldPrecision::rounded;
  const Organ& organ = shared_organ(rounded ? "precision tiny rounded" : "precision tiny", [&] {
    OrganSpec spec = touched(unit_block(5), kMostOfPrecision, 0.2);
    spec.sites.resize(4);
    spec.precision = precision;
    return spec;
  });
  const Assembly assembly(organ.model(), organ.model().fixed_dofs());
  StaticSolver solver(assembly);
  factor_at_rest(solver);
  const Eigen::Vector3d d(0.3, -0.2, -0.9);
  const LinearContactAnswer exact = solve_contacts(solver, organ.sites(), {{0, d}});
  const Truth truth{true, size * exact.field, {size * exact.forces[0]}};
  const double part = std::min(1.0, size / (1e-9 * kMostOfPrecision));
  std::vector<Answer> answers;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL, PAL_MODEL_ZONE}) {
    answers.push_back(organ.ask(model, {push(0, size * d)}, truth));
    answers.back().displacement_error *= part;
    answers.back().force_error *= part;
  }
  return answers;
}

}  // namespace

Group precision_cases() {
  Group group{"precision",
              "float32 beside float64",
              "Fields are packed and computed in float32, forces in double: two contacts of the linear model "
              "beside back-solves in double, "
              "and pushes of next to nothing, which every model answers linearly; what is nothing beside "
              "1e-9 of the domain is no error.",
              {}};
  const Bar bar = {2e-6, 1e-8};
  const auto add = [&](const std::string& name, const std::string& hard, auto model) {
    group.cases.push_back({"precision", name, hard, bar, Expected::answer, "",
                           [=] { return linear_fields(name, model, kMostOfPrecision); }});
  };
  add("plain", "a block", [] { return unit_block(5); });
  add("inclusion", "a block with an inclusion 1e6 times stiffer",
      [] { return test::with_fixed_base(test::block_with_inclusion(1e6)); });
  add("slivers", "a block with slivers 1e6 times flatter than the cells",
      [] { return test::with_fixed_base(test::block_with_slivers(1e-6)); });
  group.cases.push_back({"precision", "incompressible", "a block of lambda / mu = 1e4", bar, Expected::limit,
                         "the forces on the nodes of a patch cancel each other but for a small part, and "
                         "float32 fields with them",
                         [] {
                           return linear_fields(
                               "incompressible",
                               [] {
                                 return unit_block(5, CompressibleNeoHookean{1, 1e4});
                               },
                               kMostOfPrecision);
                         }});
  group.cases.back().slow = true;
  for (const auto& [size, shown] :
       {std::pair{1e-9, "1e9"}, {1e-20, "1e20"}, {1e-37, "1e37"}, {1e-60, "1e60"}}) {
    const Bar linear = {1e-5, 1e-5};
    group.cases.push_back({"precision", fmt::format("tiny_{}", shown),
                           fmt::format("a push of 1 / {} of the block", shown), linear, Expected::answer, "",
                           [size = size] { return tiny(size, FieldPrecision::real); }});
  }
  const Bar rounded = {1e-4, 1e-5};
  group.cases.push_back({"precision", "rounded", "a push of 1 / 1e9 of the block, by fields of int16",
                         rounded, Expected::answer, "", [] { return tiny(1e-9, FieldPrecision::rounded); }});
  return group;
}

}  // namespace palpate::hard
