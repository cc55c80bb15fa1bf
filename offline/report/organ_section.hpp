// What a report shows of one organ: plots with how to read them, and tables.
#pragma once

#include <filesystem>
#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// Draws the organ's plots into `folder`/plots, writes its CSVs into `folder`, and returns HTML that carries the plots
// and links to the rest. Throws std::runtime_error where a file cannot be written or gnuplot complains.
std::string write_organ_section(const OrganReport& organ, const std::filesystem::path& folder);

// The same tables as Markdown, for a README.
std::string organ_markdown(const OrganReport& organ);

// Why the pack does not keep what it says, in a sentence for each model; empty where it does.
std::string broken_promises(const OrganReport& organ);

}  // namespace palpate
