// Writes the report's section of one organ: plots with explanations, and tables.
#pragma once

#include <filesystem>
#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// Draws plots into `folder`/plots, writes CSVs into `folder`, and returns HTML with plots and links. Throws
// std::runtime_error where a file cannot be written or gnuplot fails.
std::string write_organ_section(const OrganReport& organ, const std::filesystem::path& folder);

// Formats the same tables as Markdown, for a README.
std::string organ_markdown(const OrganReport& organ);

// Returns a sentence for each model whose new errors contradict the pack's survey; empty where all agree.
std::string broken_promises(const OrganReport& organ);

}  // namespace palpate
