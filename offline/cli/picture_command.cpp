// palpate picture: draws an organ at rest and pushed, from the runtime's response.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <filesystem>
#include <stdexcept>

#include "offline/cli/commands.hpp"
#include "offline/cli/contact_arguments.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/mesh/text_number.hpp"
#include "offline/output/organ_picture.hpp"

namespace palpate {
namespace {

struct PictureArguments {
  std::filesystem::path pack;
  ContactArguments contacts;
  std::filesystem::path output;
  std::string title;
  bool json = false;
};

// Returns the contact that is drawn where none is given: the highest site pushed straight down, as far as the
// scene goes.
std::string push_from_above(const OpenedPack& opened) {
  const pal_pack_info info = opened.info();
  std::uint32_t highest = 0;
  for (std::uint32_t site = 1; site < info.num_sites; ++site) {
    if (position_of_site(opened, site).z() > position_of_site(opened, highest).z()) highest = site;
  }
  return fmt::format("{}=0,0,{:.9g}", opened.label_of_site(highest),
                     -opened.tables().sites()->max_displacement());
}

int run_picture(PictureArguments arguments) {
  if (lower_case(arguments.output.extension().string()) != ".png")
    throw std::runtime_error(arguments.output.string() + ": pictures are PNG; name a file that ends in .png");
  check_keeps_inputs(arguments.output, {arguments.pack});
  check_replaces(arguments.output, "\x89PNG", "a PNG");
  const OpenedPack opened(arguments.pack);
  ContactArguments& given = arguments.contacts;
  // Gravity alone is worth a picture, too.
  if (given.contacts.empty() && given.points.empty() && given.gravity.empty())
    given.contacts.push_back(push_from_above(opened));
  const ContactAnswer answer = answer_contacts(opened, arguments.contacts);
  const pal_geometry geometry = opened.pack().geometry();
  PictureInput input;
  for (std::uint32_t i = 0; i < geometry.num_nodes; ++i) {
    input.rest.emplace_back(geometry.positions + size_t{3} * i);
    input.displacement.emplace_back(answer.field.segment<3>(3 * i));
  }
  for (std::uint32_t i = 0; i < geometry.num_triangles; ++i) {
    const std::uint32_t* corners = geometry.triangles + size_t{3} * i;
    input.triangles.push_back(
        {static_cast<int>(corners[0]), static_cast<int>(corners[1]), static_cast<int>(corners[2])});
  }
  input.title = arguments.title;
  input.length_unit = opened.length_unit();
  for (size_t c = 0; c < answer.contacts.size(); ++c) {
    input.tools.push_back({answer.places[c].position, Eigen::Vector3d(answer.contacts[c].displacement),
                           opened.tables().sites()->tip_radius()});
    const pal_contact_result& result = answer.results[c];
    input.caption +=
        fmt::format("{}{} {}: {:.3g}{} pushed, {:.3g}{} force ({})", c == 0 ? "" : ";  ",
                    answer.places[c].is_site ? "node" : "at", answer.places[c].name,
                    Eigen::Vector3d(answer.contacts[c].displacement).norm(), opened.length_suffix(),
                    Eigen::Vector3d(result.force).norm(), opened.force_suffix(), model_name(result.model));
  }
  write_before_after(input, {}, arguments.output);
  if (arguments.json) {
    std::vector<int> labels;
    for (const TouchedPlace& place : answer.places) labels.push_back(place.label());
    fmt::print("{}\n", json_text({{"picture", arguments.output.string()}, {"contacts", labels}}));
  } else {
    fmt::print("wrote {}\n", arguments.output.string());
  }
  return 0;
}

}  // namespace

void add_picture_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<PictureArguments>();
  CLI::App* command =
      app.add_subcommand("picture", "Draw the organ before and after a push, as the runtime answers it");
  command->footer(
      "Without a contact, the highest site is pushed straight down, as far as the scene goes.\n\n"
      "Example: palpate picture brain.pack --contact 812=0,0,-8 -o push.png");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  add_contact_options(*command, arguments->contacts);
  command->add_option("--title", arguments->title, "Line above the picture")->type_name("TEXT");
  command->add_option("-o,--output", arguments->output, "PNG file to write")
      ->type_name("FILE.png")
      ->required();
  command->add_flag("--json", arguments->json, "Print what was drawn as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_picture(*arguments); });
}

}  // namespace palpate
