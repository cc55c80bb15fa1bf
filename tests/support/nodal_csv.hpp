// Reads the nodal tables of `solve` and `eval` by their headings alone, as other software would.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/run_program.hpp"

namespace palpate::test {

struct CsvRow {
  int node = 0;
  std::array<double, 3> x{}, u{}, f{};
  std::vector<std::string> fields;
};

inline std::vector<CsvRow> read_csv(const std::filesystem::path& file) {
  std::istringstream text(file_text(file));
  std::string line;
  std::getline(text, line);
  EXPECT_EQ(line, "node,x,y,z,ux,uy,uz,fx,fy,fz");
  std::vector<CsvRow> rows;
  while (std::getline(text, line)) {
    CsvRow row;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');) row.fields.push_back(field);
    row.fields.resize(10);
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 9) << line;
    row.node = std::stoi(row.fields[0]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      row.x[axis] = std::stod(row.fields[1 + axis]);
      row.u[axis] = std::stod(row.fields[4 + axis]);
      if (!row.fields[7 + axis].empty()) row.f[axis] = std::stod(row.fields[7 + axis]);
    }
    rows.push_back(row);
  }
  return rows;
}

inline const CsvRow& row_of(const std::vector<CsvRow>& rows, int node) {
  for (const CsvRow& row : rows) {
    if (row.node == node) return row;
  }
  throw std::invalid_argument("no row of node " + std::to_string(node));
}

}  // namespace palpate::test
