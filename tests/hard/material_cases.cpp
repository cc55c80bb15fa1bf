// Laws and stiffness: nearly incompressible tissue, and inclusions ten thousand times stiffer or softer.
#include <fmt/core.h>

#include <tuple>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/support/pressurised_tube.hpp"

namespace palpate::hard {
namespace {

constexpr double kNoduleDepth = 0.15;
constexpr double kNoduleRadius = 0.26;

std::vector<Answer> top_solved(Model block) {
  const test::SolverScene scene = test::moved_top(std::move(block), {0.15, 0.05, -0.2});
  return {solved_on_two_paths(scene, test::nodes_on_plane(scene.model, 2, 1.0), 0.25)};
}

Model bare_block(const Law& law) {
  Model block = unit_block(5, law);
  block.fixed.clear();
  return block;
}

// Makes the elements with a centre near `place` `ratio` times stiffer.
Model with_lump(Model model, const Eigen::Vector3d& place, double radius, double ratio) {
  model.materials.push_back({"LUMP", CompressibleNeoHookean{ratio * kTissue.mu, ratio * kTissue.lambda}});
  for (Tetrahedron& element : model.elements) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const int node : element.corners()) centre += model.positions[static_cast<size_t>(node)] / 4;
    if ((centre - place).norm() < radius) element.material = 1;
  }
  return model;
}

std::vector<Answer> pack_of(const std::string& name, const std::function<Model()>& model, const Bar& bar,
                            bool polynomial = true) {
  const Organ& organ = shared_organ(name, [&] {
    OrganSpec spec = touched(model(), kNoduleDepth, kNoduleRadius);
    std::sort(spec.sites.begin(), spec.sites.end(), [&](int a, int b) {
      const auto aside = [&](int node) {
        return (spec.model.positions[static_cast<size_t>(node)] - Eigen::Vector3d(0.4, 0.45, 1)).norm();
      };
      return aside(a) < aside(b);
    });
    spec.sites.resize(4);
    std::sort(spec.sites.begin(), spec.sites.end());
    spec.zone_rings = 2;
    spec.polynomial = polynomial;
    return spec;
  });
  return pushed_four_ways(organ, organ.site_near({0.4, 0.45, 1}), kNoduleDepth, bar);
}

std::vector<Answer> rigid_inclusion() {
  const test::SolverScene scene = test::moved_top(test::block_with_inclusion(1e4), {0.15, 0.05, -0.2});
  const test::SceneRun run = test::run_scene(scene);
  if (!run.converged) return {refused("solve", "no equilibrium")};
  Answer answer;
  answer.by = "solve";
  answer.happened = fmt::format("{} iterations", run.iterations);
  answer.displacement_error = test::distance_from_rigid(scene.model, 1, run.displacement);
  return {answer};
}

// A computed number compared with a known number.
Answer beside(const std::string& what, double found, double known, const test::SceneRun& run) {
  if (!run.converged) return refused("solve", "no equilibrium");
  Answer answer;
  answer.by = "solve";
  answer.happened = fmt::format("{} {:.5g} beside {:.5g}; {} increments, {} iterations", what, found, known,
                                run.increments, run.iterations);
  answer.finite = run.displacement.allFinite();
  answer.displacement_error = std::abs(found / known - 1);
  return answer;
}

// Cook's membrane at nu = 0.499, 32 cells of four nodes or 16 of ten a side. The limit of finer meshes is in
// docs/solver_validation.md.
std::vector<Answer> membrane(test::Elements elements) {
  const int cells = elements == test::Elements::c3d10h ? 16 : 32;
  const test::SolverScene scene =
      test::cooks_membrane(cells, elements, test::neo_hooke_of(test::kCookShearModulus, 0.499));
  const test::SceneRun run = test::run_scene(scene);
  return {beside("rise", test::cooks_tip(scene, run), 6.9489, run)};
}

// Eq. (1) with lambda / mu = 1e4. The closed form of an incompressible tube gives the opening.
std::vector<Answer> inflated_tube(test::Elements elements) {
  constexpr double kOpening = 0.2;
  const test::Tube tube = test::pressurised_tube(elements == test::Elements::c3d10h ? 4 : 8, elements,
                                                 CompressibleNeoHookean{1, 1e4});
  test::SolverScene scene{tube.model, {LoadCase::rest(tube.model)}};
  for (const auto& [element, face] : tube.inside)
    scene.steps[0].pressures[{element, face}] = test::tube_pressure(1, kOpening);
  const test::SceneRun run = test::run_scene(scene);
  return {beside("opening", test::tube_opening(tube, run.displacement), kOpening, run)};
}

}  // namespace

Group material_cases() {
  Group group{"material",
              "Nearly incompressible, stiff and soft",
              "Solves beside the same in sixteen increments; packs of blocks whose sites are pushed by 15 % "
              "of the thickness, four ways, "
              "beside full solves of the same mesh. Four-node tetrahedra lock at such ratios: what is judged "
              "here is that the pack "
              "answers as its mesh does, not that the mesh is tissue. Elements that share their volumes "
              "(MEAN DILATATION, C3D10H) do not: they are judged beside what is known of the tissue, too.",
              {}};
  const auto add = [&](const std::string& name, const std::string& hard, const Bar& bar, auto run) {
    group.cases.push_back({"material", name, hard, bar, Expected::answer, "", run});
  };
  const Bar other_path = {1e-6, 1e-6};
  const Bar pack = {0.02, 0.02};
  for (const double ratio : {1e2, 1e4}) {
    const CompressibleNeoHookean law = {1, ratio};
    const int power = ratio > 1e3 ? 4 : 2;
    add(fmt::format("lambda_1e{}_solved", power),
        fmt::format("lambda / mu = 1e{}: block compressed by 20 % and sheared", power), other_path,
        [law] { return top_solved(bare_block(law)); });
    add(fmt::format("lambda_1e{}_pack", power), fmt::format("lambda / mu = 1e{}: pack", power), pack, [=] {
      return pack_of(
          fmt::format("lambda {}", ratio), [&] { return unit_block(5, law); }, pack);
    });
    group.cases.back().slow = ratio > 1e3;
  }
  const auto zone_only = [=](const std::string& name, const std::string& hard,
                             const std::function<Model()>& model) {
    add(name, hard, pack, [=] { return pack_of(name, model, pack, false); });
  };
  zone_only("lambda_10_zones", "lambda / mu = 10 (nu = 0.455): pack of zones", [] {
    return unit_block(5, CompressibleNeoHookean{1, 10});
  });
  zone_only("lambda_1e2_zones", "lambda / mu = 1e2: pack of zones", [] {
    return unit_block(5, CompressibleNeoHookean{1, 1e2});
  });
  zone_only("inclusion_zones", "pack of zones with an inclusion 1e4 times stiffer under the sites", [] {
    return with_lump(unit_block(5), {0.5, 0.5, 0.6}, 0.25, 1e4);
  });
  const Bar known = {0.03, 0.03};  // discretisation error
  for (const auto& [elements, name, hard] :
       {std::tuple{test::Elements::c3d4_mean_dilatation, "mean_dilatation", "C3D4 MEAN DILATATION"},
        {test::Elements::c3d10h, "c3d10h", "C3D10H"}}) {
    const int cells = elements == test::Elements::c3d10h ? 2 : 5;
    add(fmt::format("{}_membrane", name), fmt::format("{}, nu = 0.499: Cook's membrane", hard), known,
        [elements = elements] { return membrane(elements); });
    add(fmt::format("{}_tube_1e4", name),
        fmt::format("{}, lambda / mu = 1e4: a thick tube opened by a fifth by pressure", hard), known,
        [elements = elements] { return inflated_tube(elements); });
    add(fmt::format("{}_1e4_solved", name),
        fmt::format("{}, lambda / mu = 1e4: block compressed by 20 % and sheared", hard), other_path,
        [elements = elements, cells] {
          Model block = nearly_incompressible_block(cells, elements, CompressibleNeoHookean{1, 1e4});
          block.fixed.clear();
          return top_solved(std::move(block));
        });
    const auto block_of = [elements = elements, cells](const Law& law) {
      return [=] { return nearly_incompressible_block(cells, elements, law); };
    };
    const Law tissue = test::neo_hooke_of(1, 0.499);
    const std::string pack_name = fmt::format("{}_pack", name);
    add(pack_name, fmt::format("{}, nu = 0.499: pack", hard), pack,
        [=] { return pack_of(pack_name, block_of(tissue), pack); });
    group.cases.back().slow = elements == test::Elements::c3d4_mean_dilatation;
    const std::string stiff_name = fmt::format("{}_1e4_pack", name);
    add(stiff_name, fmt::format("{}, lambda / mu = 1e4: pack", hard), pack, [=] {
      return pack_of(stiff_name, block_of(CompressibleNeoHookean{1, 1e4}), pack);
    });
    group.cases.back().slow = true;
  }
  const auto shared = [](int cells, test::Elements elements, double poisson) {
    return [=] { return nearly_incompressible_block(cells, elements, test::neo_hooke_of(1, poisson)); };
  };
  zone_only("mean_dilatation_zones", "C3D4 MEAN DILATATION, nu = 0.499: pack of zones",
            shared(5, test::Elements::c3d4_mean_dilatation, 0.499));
  group.cases.back().slow = true;
  zone_only("c3d10h_zones_049", "C3D10H, nu = 0.49: pack of zones", shared(2, test::Elements::c3d10h, 0.49));
  zone_only("c3d10h_zones", "C3D10H, nu = 0.499: pack of zones", shared(2, test::Elements::c3d10h, 0.499));
  group.cases.back().slow = true;
  add("inclusion_solved", "inclusion 1e4 times stiffer: block compressed by 20 % and sheared", other_path,
      [] { return top_solved(test::block_with_inclusion(1e4)); });
  add("inclusion_is_rigid",
      "inclusion 1e4 times stiffer moves as a rigid body (error: distance from the nearest)", {1e-3, 1e-3},
      rigid_inclusion);
  add("soft_inclusion_solved", "inclusion 1e4 times softer: block compressed by 20 % and sheared", other_path,
      [] { return top_solved(test::block_with_inclusion(1e-4)); });
  const Eigen::Vector3d below(0.5, 0.5, 0.6);
  const Eigen::Vector3d at_top(0.5, 0.5, 1.0);
  add("inclusion_below_pack", "pack with an inclusion 1e4 times stiffer under the sites", pack, [=] {
    return pack_of(
        "inclusion below", [&] { return with_lump(unit_block(5), below, 0.25, 1e4); }, pack);
  });
  add("inclusion_at_site_pack",
      "pack with an inclusion 1e4 times stiffer at the sites, partly within the patches", pack, [=] {
        return pack_of(
            "inclusion at site", [&] { return with_lump(unit_block(5), at_top, 0.3, 1e4); }, pack);
      });
  add("pocket_pack", "pack with a pocket 1e4 times softer under the sites", pack, [=] {
    return pack_of(
        "pocket", [&] { return with_lump(unit_block(5), below, 0.25, 1e-4); }, pack);
  });
  return group;
}

}  // namespace palpate::hard
