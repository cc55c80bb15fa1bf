// Contacts: coincident, duplicate, clustered, opposed, and at the boundary of the fixed base.
#include <fmt/core.h>

#include <filesystem>
#include <random>
#include <stdexcept>
#include <tuple>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

constexpr double kMostOfContacts = 0.2;  // about an edge

// Sixteen sites with overlapping patches, two rings.
const Organ& cluster() {
  return shared_organ("cluster", [] {
    OrganSpec spec = touched(unit_block(5), kMostOfContacts, 0.21);
    spec.zone_rings = 2;
    spec.max_contacts = 8;
    return spec;
  });
}

// The same with single nodes as patches: neighbours have no common node.
const Organ& points() {
  return shared_organ("points", [] {
    OrganSpec spec = touched(unit_block(5), kMostOfContacts, 0);
    spec.zone_rings = 2;
    spec.max_contacts = 3;
    return spec;
  });
}

std::uint32_t at(const Organ& organ, double x, double y) {
  return organ.site_near({x, y, 1});
}

// Three neighbouring sites pushed in random directions by `size`.
std::vector<Answer> triples_of_size(const Organ& organ, double size, int count, const Bar& bar) {
  std::mt19937 random(5);
  const auto direction = [&] {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  std::vector<std::vector<Answer>> sets;
  for (int tried = 0; static_cast<int>(sets.size()) < count; ++tried) {
    if (tried == 4 * count) throw std::runtime_error("most of the full solves find no equilibrium");
    const auto first = static_cast<std::uint32_t>(random() % organ.num_sites());
    std::vector<std::uint32_t> near(organ.num_sites());
    for (std::uint32_t site = 0; site < near.size(); ++site) near[site] = site;
    const auto place = [&](std::uint32_t site) {
      return organ.model().positions[static_cast<size_t>(organ.sites().sites[site].node)];
    };
    std::sort(near.begin(), near.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair((place(a) - place(first)).norm(), a) < std::pair((place(b) - place(first)).norm(), b);
    });
    std::vector<pal_contact> contacts;
    for (size_t i = 0; i < 3; ++i) contacts.push_back(push(near[i], size * direction()));
    if (!organ.solve(contacts).solved) continue;
    sets.push_back(ask_all(organ, contacts));
  }
  return worst_of(sets, bar);
}

// Pushes by such fractions of an edge, the largest first.
std::vector<Answer> random_triples(const Organ& organ, const std::vector<double>& parts, double edge,
                                   int count, const Bar& bar) {
  std::vector<Answer> answers;
  for (const double part : parts) {
    for (Answer& answer : triples_of_size(organ, part * edge, count, bar)) {
      answer.by += fmt::format(", {:g} edge{}", part, part == 1 ? "" : "s");
      answers.push_back(answer);
    }
  }
  return answers;
}

// Twelve neighbouring sites of the shipped brain.
std::vector<Answer> brain_triples(const Bar& bar) {
  LoadedScene loaded =
      read_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "brain" / "brain_zone.toml");
  const auto place = [&](int node) { return loaded.model.positions[static_cast<size_t>(node)]; };
  const Eigen::Vector3d first = place(loaded.scene.sites.front());
  std::sort(loaded.scene.sites.begin(), loaded.scene.sites.end(),
            [&](int a, int b) { return (place(a) - first).norm() < (place(b) - first).norm(); });
  loaded.scene.sites.resize(12);
  std::sort(loaded.scene.sites.begin(), loaded.scene.sites.end());
  const Organ organ(loaded.model, loaded.scene);
  return random_triples(organ, {1, 0.5, 0.1}, organ.edge(), 40, bar);
}

// Sites beside the fixed base, which cuts some patches.
std::vector<Answer> beside_the_base(const Bar& bar) {
  const Organ& organ = shared_organ("beside the base", [] {
    OrganSpec spec;
    spec.model = unit_block(5);
    for (const int node : test::nodes_on_plane(spec.model, 0, 1.0)) {
      const Eigen::Vector3d& at = spec.model.positions[static_cast<size_t>(node)];
      if (std::abs(at.z() - 0.2) < 1e-3 && at.y() > 0.1 && at.y() < 0.9) spec.sites.push_back(node);
    }
    spec.max_displacement = 0.1;
    spec.tip_radius = 0.21;
    spec.zone_rings = 2;
    return spec;
  });
  std::vector<std::vector<Answer>> sets;
  for (const Eigen::Vector3d& d : {Eigen::Vector3d(-0.1, 0, 0), Eigen::Vector3d(0, 0, -0.1),
                                   Eigen::Vector3d(0, 0, 0.1), Eigen::Vector3d(0.06, 0.06, 0.05)})
    sets.push_back(ask_all(organ, {push(1, d)}));
  return worst_of(sets, bar);
}

// A contact between three sites. The reference is the blend of the full solves at each.
std::vector<Answer> between_sites(const Eigen::Vector3d& d) {
  const Organ& organ = cluster();
  const std::uint32_t corners[3] = {at(organ, 0.4, 0.4), at(organ, 0.6, 0.4), at(organ, 0.6, 0.6)};
  constexpr double kWeights[3] = {0.4, 0.35, 0.25};
  Truth truth;
  for (int corner = 0; corner < 3; ++corner) {
    const Truth own = organ.solve({push(corners[corner], d)});
    if (corner == 0) truth = {true, Eigen::VectorXd::Zero(own.field.size()), {Eigen::Vector3d::Zero()}};
    truth.solved = truth.solved && own.solved;
    if (!truth.solved) break;
    truth.field += kWeights[corner] * own.field;
    truth.forces.front() += kWeights[corner] * own.forces.front();
  }
  pal_contact contact = push(corners[0], d);
  for (int i = 0; i < 2; ++i) {
    contact.neighbours[i] = corners[i + 1];
    contact.neighbour_weights[i] = kWeights[i + 1];
  }
  std::vector<Answer> answers;
  for (const pal_model model : models_for_one(organ)) answers.push_back(organ.ask(model, {contact}, truth));
  return answers;
}

// A contact with a prescribed force inwards: the linear model's force for a push. The reference is the full
// solve at the resulting displacement.
std::vector<Answer> given_force(const Eigen::Vector3d& d) {
  const Organ& organ = cluster();
  constexpr std::uint32_t kInwards = 2;
  const std::uint32_t site = at(organ, 0.4, 0.4);
  const double force = ModelUnitSession(organ.opened(), PAL_MODEL_LINEAR, 1, 1)
                           .settle(std::vector{push(site, d)})[0]
                           .force[kInwards];
  std::vector<Answer> answers;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    ModelUnitSession session(organ.opened(), model, 1, 1);
    pal_contact contact = push(site, {d.x(), d.y(), 0});
    contact.force_axes = 1U << kInwards;
    contact.force[kInwards] = force;
    const auto results = session.settle(std::vector{contact});
    const pal_contact got = push(site, Eigen::Vector3d(results[0].displacement));
    Truth truth = organ.solve({got});
    if (truth.solved) truth.forces.front()[kInwards] = force;
    answers.push_back(organ.compare(model == PAL_MODEL_AUTO ? "auto" : model_name(model), {got}, results,
                                    session.visual_frame(), truth));
  }
  return answers;
}

// A node of the contact's patch, or a neighbour of the patch, fixed while running.
std::vector<Answer> fixed_while_running(bool within_patch, double part) {
  const Organ& organ = cluster();
  const std::uint32_t site = at(organ, 0.4, 0.4);
  const ContactSite& touched = organ.sites().sites[within_patch ? site : at(organ, 0.8, 0.4)];
  const int node = touched.node;
  const std::vector<pal_contact> contacts = {push(site, {0, 0, -part * kMostOfContacts})};
  const Truth truth = organ.solve(contacts, 8, {node});
  std::vector<Answer> answers;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    const std::string by = model == PAL_MODEL_AUTO ? "auto" : model_name(model);
    try {
      ModelUnitSession session(organ.opened(), model, 1, 1);
      std::uint32_t contact_node = 0;
      require_ok(pal_pack_find_contact_node(organ.opened().pack().get(),
                                            organ.model().labels[static_cast<size_t>(node)], &contact_node),
                 "contact node");
      session.fix(std::vector<std::uint32_t>{contact_node});
      const auto results = session.settle(contacts);
      answers.push_back(organ.compare(by, contacts, results, session.visual_frame(), truth));
    } catch (const std::exception& error) {
      answers.push_back(refused(by, error.what()));
    }
  }
  return answers;
}

}  // namespace

Group contact_cases() {
  Group group{
      "contact",
      "Contacts",
      "A block of 5 x 5 x 5 cells with sixteen sites on its top, each a patch that shares nodes with "
      "its neighbours' or a node "
      "alone, pushed by parts of an edge. A node of several contacts follows their mean, in the full "
      "solve, too. Estimates "
      "of zones are those of surveyed sets of two and three contacts whose patches share no node; of more "
      "of them, of patches that share "
      "nodes, and of the linear model errors are not known.",
      {}};
  const auto add = [&](const std::string& name, const std::string& hard, auto run,
                       const std::string& limit = "") {
    group.cases.push_back({"contact",
                           name,
                           hard,
                           {0.02, 0.02},
                           limit.empty() ? Expected::answer : Expected::limit,
                           limit,
                           run});
  };
  const Bar bar = {0.02, 0.02};
  const Eigen::Vector3d in(0, 0, -0.5 * kMostOfContacts);
  add("coincident", "two contacts at one site, moved alike by half an edge", [=] {
    const std::uint32_t site = at(cluster(), 0.4, 0.4);
    return ask_all(cluster(), {push(site, in), push(site, in)});
  });
  add("coincident_against", "two contacts at one site, moved apart", [=] {
    const std::uint32_t site = at(cluster(), 0.4, 0.4);
    return ask_all(cluster(), {push(site, in), push(site, {0.05, 0, 0.05})});
  });
  add("duplicates", "eight contacts at one site",
      [=] { return ask_all(cluster(), std::vector<pal_contact>(8, push(at(cluster(), 0.6, 0.6), in))); });
  add("clustered", "four neighbours that share nodes, moved alike by half an edge", [=] {
    const Organ& organ = cluster();
    return ask_all(organ, {push(at(organ, 0.4, 0.4), in), push(at(organ, 0.6, 0.4), in),
                           push(at(organ, 0.4, 0.6), in), push(at(organ, 0.6, 0.6), in)});
  });
  const auto askew = [](double size) {
    const Organ& organ = cluster();
    return std::vector<pal_contact>{push(at(organ, 0.4, 0.4), size * Eigen::Vector3d(0.05, 0, -0.1)),
                                    push(at(organ, 0.6, 0.4), size * Eigen::Vector3d(-0.03, 0.04, -0.06)),
                                    push(at(organ, 0.4, 0.6), size * Eigen::Vector3d(0, 0, 0.08))};
  };
  add("clustered_askew_twentieth",
      "three neighbours that share nodes, each moved otherwise, by up to a twentieth of an edge",
      [=] { return ask_all(cluster(), askew(0.1)); });
  add("clustered_askew_half",
      "three neighbours that share nodes, each moved otherwise, by up to half an edge",
      [=] { return ask_all(cluster(), askew(1)); });
  add("neighbours_together", "two neighbouring nodes pushed in together by half an edge", [=] {
    return ask_all(points(), {push(at(points(), 0.4, 0.4), in), push(at(points(), 0.6, 0.4), in)});
  });
  const auto apart = [](double size) {
    const Eigen::Vector3d aside(size * kMostOfContacts, 0, 0);
    return ask_all(points(), {push(at(points(), 0.4, 0.4), -aside), push(at(points(), 0.6, 0.4), aside)});
  };
  add("neighbours_apart_quarter", "two neighbouring nodes pulled apart by a quarter of an edge each",
      [=] { return apart(0.25); });
  add("neighbours_apart_half", "two neighbouring nodes pulled apart by half an edge each",
      [=] { return apart(0.5); });
  add("triples_of_nodes", "twenty sets of three neighbouring nodes in random directions", [bar] {
    return random_triples(points(), {1, 0.5, 0.1}, kMostOfContacts, 20, bar);
  });
  add("triples_of_patches", "twenty sets of three neighbouring patches that share nodes in random directions",
      [bar] {
        return random_triples(cluster(), {1, 0.5, 0.1}, kMostOfContacts, 20, bar);
      });
  add("nine", "nine contacts, one more than zones take, pushed in by a tenth of an edge", [=] {
    std::vector<pal_contact> contacts;
    for (std::uint32_t site = 0; site < 9; ++site) contacts.push_back(push(site, 0.2 * in));
    return ask_all(cluster(), contacts);
  });
  add(
      "all_sites", "all sixteen sites at once, pushed in by half an edge",
      [=] {
        std::vector<pal_contact> contacts;
        for (std::uint32_t site = 0; site < cluster().num_sites(); ++site) contacts.push_back(push(site, in));
        return ask_all(cluster(), contacts);
      },
      "more than eight contacts are answered by the linear model");
  add("between_sites", "a contact between three sites, moved in and aside by half an edge", [] {
    return between_sites({0.05, -0.03, -0.08});
  });
  add("given_force",
      "a contact of which the force inwards is given, for a third of an edge, and which is moved aside", [] {
        return given_force({0.03, 0, -0.06});
      });
  add("beside_the_base", "a site beside the fixed base, which cuts its patch",
      [bar] { return beside_the_base(bar); });
  add("fixed_neighbour_tenth",
      "a contact pushed in by a tenth of an edge, and a node two sites away fixed while running",
      [] { return fixed_while_running(false, 0.1); });
  add("fixed_within_half", "a contact pushed in by half an edge, whose centre is fixed while running",
      [] { return fixed_while_running(true, 0.5); });
  group.cases.push_back(
      {"contact", "brain_triples",
       "the brain, two rings: forty sets of three neighbouring patches in random directions", bar,
       Expected::answer, "", [bar] { return brain_triples(bar); }, true});
  return group;
}

}  // namespace palpate::hard
