// A small model file as text, and changed copies of it.
#pragma once

#include <string>

namespace palpate::test {

// Two tetrahedra with a common face, held at three nodes, loaded at the fourth and the fifth.
inline const std::string kBody =
    "*NODE, NSET=ALL\n"                                       // 1
    "1, 0, 0, 0\n"                                            // 2
    "2, 1, 0, 0\n"                                            // 3
    "3, 0, 1, 0\n"                                            // 4
    "4, 0, 0, 1\n"                                            // 5
    "5, 1, 1, 1\n"                                            // 6
    "*ELEMENT, TYPE=C3D4, ELSET=BODY\n"                       // 7
    "1, 1, 2, 3, 4\n"                                         // 8
    "2, 2, 5, 3, 4\n"                                         // 9
    "*NSET, NSET=BASE\n"                                      // 10
    "1, 2, 3\n"                                               // 11
    "*MATERIAL, NAME=TISSUE\n"                                // 12
    "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n"                 // 13
    "0.48, 0.2\n"                                             // 14
    "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n"           // 15
    "*BOUNDARY\n"                                             // 16
    "BASE, 1, 3\n";                                           // 17
inline const std::string kStep = "*STEP, NLGEOM\n*STATIC\n";  // 18, 19
inline const std::string kEnd = "*END STEP\n";

// kBody with line number `line` (from 1) replaced by one or several lines.
inline std::string with_line(int line, const std::string& replacement, const std::string& text = kBody) {
  std::string result;
  std::size_t begin = 0;
  for (int number = 1; begin < text.size(); ++number) {
    const std::size_t end = text.find('\n', begin) + 1;
    result +=
        number == line ? replacement + (replacement.empty() ? "" : "\n") : text.substr(begin, end - begin);
    begin = end;
  }
  return result;
}

}  // namespace palpate::test
