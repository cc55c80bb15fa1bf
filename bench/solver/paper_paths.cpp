#include "bench/solver/paper_paths.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "bench/solver/paper_laws.hpp"

namespace palpate::test {
namespace {

template <typename Body>
Path follow(Body& body, int sign) {
  Path path;
  for (size_t index = 0; index <= kLargest; ++index) {
    const auto displacement = body.under(force_at(sign, index));
    if (!displacement) throw std::runtime_error(fmt::format("no equilibrium at {}", force_at(sign, index)));
    path.push_back(*displacement);
  }
  return path;
}

}  // namespace

Paths solved(const Law& law) {
  Paths paths;
  for (const int sign : {-1, 1}) {
    LoadedCylinder body(paper_cylinder(PALPATE_SOURCE_DIR, law));
    paths[sign] = follow(body, sign);
  }
  return paths;
}

Paths solved_by_small_newton(const SmallNewton::Response& response) {
  const Model model = paper_cylinder(PALPATE_SOURCE_DIR, CompressibleNeoHookean{kPaperMu, kPaperLambda});
  Paths paths;
  for (const int sign : {-1, 1}) {
    SmallNewton body(model, response);
    paths[sign] = follow(body, sign);
  }
  return paths;
}

LawPaths solve_all(double ratio) {
  const double lambda = ratio * kPaperLambda;
  return {solved(CompressibleNeoHookean{kPaperMu, lambda}), solved(equation_11(kPaperMu, lambda)),
          solved(equation_11(kPaperMu, lambda + 2 * kPaperMu / 3)),
          solved_by_small_newton([=](const Eigen::Matrix3d& F) { return with_volume_term(lambda, F); })};
}

}  // namespace palpate::test
