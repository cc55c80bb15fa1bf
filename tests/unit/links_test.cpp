// Every relative link and anchor of the repository's pages has a target, and the README is short.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace links_test {

namespace fs = std::filesystem;

const fs::path kSource = PALPATE_SOURCE_DIR;
constexpr std::size_t kMostReadmeBytes = 8192;

std::vector<std::string> lines_of(const fs::path& file) {
  std::vector<std::string> lines;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// The lines of a page without code: fenced blocks become empty lines, spans in backticks disappear.
std::vector<std::string> prose_of(const fs::path& page) {
  std::vector<std::string> lines = lines_of(page);
  bool in_block = false;
  for (std::string& line : lines) {
    const bool is_fence = line.starts_with("```");
    if (is_fence) in_block = !in_block;
    if (is_fence || in_block) line.clear();
    for (std::size_t begin = line.find('`'); begin != std::string::npos; begin = line.find('`', begin)) {
      const std::size_t end = line.find('`', begin + 1);
      if (end == std::string::npos) break;
      line.erase(begin, end + 1 - begin);
    }
  }
  return lines;
}

// GitHub's anchor of a heading: lower case, blanks as hyphens, no other punctuation, links as their text.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  bool in_target = false;
  for (std::size_t i = 0; i < heading.size(); ++i) {
    const auto byte = static_cast<unsigned char>(heading[i]);
    if (byte == '(' && i > 0 && heading[i - 1] == ']') in_target = true;
    if (in_target) {
      in_target = byte != ')';
      continue;
    }
    if (std::isalnum(byte) != 0 || byte == '_' || byte == '-' || byte >= 128)
      anchor += static_cast<char>(std::tolower(byte));
    if (byte == ' ') anchor += '-';
  }
  return anchor;
}

std::vector<std::string> anchors_of(const fs::path& page) {
  std::vector<std::string> anchors;
  std::map<std::string, int> repeats;
  bool in_block = false;
  for (const std::string& line : lines_of(page)) {
    if (line.starts_with("```")) in_block = !in_block;
    const std::size_t level = line.find_first_not_of('#');
    if (in_block || level == 0 || level == std::string::npos || line[level] != ' ') continue;
    const std::string anchor = anchor_of(line.substr(level + 1));
    const int repeat = repeats[anchor]++;
    anchors.push_back(repeat == 0 ? anchor : anchor + "-" + std::to_string(repeat));
  }
  return anchors;
}

bool is_elsewhere(const std::string& target) {
  return target.find("://") != std::string::npos || target.starts_with("mailto:");
}

bool leads_somewhere(const fs::path& page, const std::string& target) {
  const std::size_t hash = target.find('#');
  const std::string path = target.substr(0, hash);
  const fs::path file = path.empty() ? page : page.parent_path() / path;
  if (!fs::exists(file)) return false;
  if (hash == std::string::npos) return true;
  const std::vector<std::string> anchors = anchors_of(file);
  return std::find(anchors.begin(), anchors.end(), target.substr(hash + 1)) != anchors.end();
}

// "page:line: target" of each relative link without a target.
std::vector<std::string> broken_links(const fs::path& page) {
  std::vector<std::string> broken;
  const std::vector<std::string> prose = prose_of(page);
  for (std::size_t i = 0; i < prose.size(); ++i) {
    const std::string& line = prose[i];
    for (std::size_t at = line.find("]("); at != std::string::npos; at = line.find("](", at + 2)) {
      const std::string target = line.substr(at + 2, line.find_first_of(") ", at + 2) - at - 2);
      if (!is_elsewhere(target) && !leads_somewhere(page, target))
        broken.push_back(page.string() + ":" + std::to_string(i + 1) + ": " + target);
    }
  }
  return broken;
}

// Every page below the folder, without hidden folders and build folders.
std::vector<fs::path> pages_below(const fs::path& folder) {
  std::vector<fs::path> pages;
  for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::recursive_directory_iterator();
       ++entry) {
    const std::string name = entry->path().filename().string();
    if (entry->is_directory() && (name.starts_with(".") || name == "build"))
      entry.disable_recursion_pending();
    else if (entry->path().extension() == ".md")
      pages.push_back(entry->path());
  }
  std::sort(pages.begin(), pages.end());
  return pages;
}

TEST(Links, EveryLinkHasATarget) {
  const std::vector<fs::path> pages = pages_below(kSource);
  ASSERT_GT(pages.size(), 20U);
  for (const fs::path& page : pages) {
    for (const std::string& link : broken_links(page)) ADD_FAILURE() << link;
  }
}

TEST(Links, ReadmeIsShort) {
  EXPECT_LE(fs::file_size(kSource / "README.md"), kMostReadmeBytes);
}

// Breaks the guard on purpose: the check finds every kind of broken link and accepts good links.
TEST(Links, BrokenOnesAreSeen) {
  const TempDir dir;
  dir.write("other.md", "# Two words, a [link](x.md)\n\n## Twice\n\n## Twice\n\n```\n# no heading\n```\n");
  const fs::path good =
      dir.write("good.md",
                "# Here\n[a](other.md) [b](other.md#two-words-a-link) ![c](other.md#twice-1) [d](#here)\n"
                "[e](https://example.org/none) `[f](none.md)` [g](.)\n```\n[h](none.md)\n```\n");
  EXPECT_EQ(broken_links(good), std::vector<std::string>());
  const fs::path bad = dir.write(
      "bad.md", "[a](none.md) [b](other.md#none)\n\n[c](#here) [d](other.md#no-heading) ![e](none.png)\n");
  const std::string name = bad.string();
  EXPECT_EQ(broken_links(bad),
            (std::vector<std::string>{name + ":1: none.md", name + ":1: other.md#none", name + ":3: #here",
                                      name + ":3: other.md#no-heading", name + ":3: none.png"}));
}

}  // namespace links_test
}  // namespace palpate::test
