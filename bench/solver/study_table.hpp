// A table of a page: Markdown under a caption of one line, and the same cells as CSV.
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace palpate::study {

class StudyTable {
 public:
  // Cells hold numbers or plain words, without commas and bars; units belong in the header.
  StudyTable(std::string name, std::string caption, std::vector<std::string> header)
      : name_(std::move(name)), caption_(std::move(caption)), rows_{std::move(header)} {}

  void add(std::vector<std::string> row) {
    if (row.size() != rows_.front().size()) throw std::logic_error(name_ + ": a row of another length");
    rows_.push_back(std::move(row));
  }

  std::string markdown() const {
    std::string text = caption_ + "\n\n";
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      text += '|';
      for (const std::string& cell : rows_[row]) text.append(1, ' ').append(cell).append(" |");
      text += '\n';
      if (row > 0) continue;
      text += '|';
      for (std::size_t column = 0; column < rows_.front().size(); ++column)
        text += column == 0 ? "---|" : "---:|";
      text += '\n';
    }
    return text;
  }

  std::string csv() const {
    std::string text;
    for (const std::vector<std::string>& row : rows_) {
      for (std::size_t column = 0; column < row.size(); ++column)
        text.append(column == 0 ? "" : ",").append(row[column]);
      text += '\n';
    }
    return text;
  }

  const std::string& name() const { return name_; }

 private:
  std::string name_;  // file name of the CSV, without its ending
  std::string caption_;
  std::vector<std::vector<std::string>> rows_;  // the header first
};

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

// Writes DIR/PAGE.md with all tables, and DIR/NAME.csv for each.
inline void write_page(const std::filesystem::path& directory, const std::string& page,
                       const std::vector<StudyTable>& tables) {
  std::string text;
  for (const StudyTable& table : tables) {
    if (!text.empty()) text += '\n';
    text += table.markdown();
    write_text(directory / (table.name() + ".csv"), table.csv());
  }
  write_text(directory / (page + ".md"), text);
}

}  // namespace palpate::study
