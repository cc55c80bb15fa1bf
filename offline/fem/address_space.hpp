// Whether the process may use the memory that BLAS takes for itself.
#pragma once

#include <string>

namespace palpate {

// OpenBLAS gives each of its threads a buffer of 128 MiB as soon as it is loaded. Where there is no room for it they
// try again for ever, and whoever waits for their end, as the end of a program does, waits as long. One line that
// says so and how to go on, or nothing: then there is room. After such a line leave by std::_Exit.
std::string address_space_shortage();

}  // namespace palpate
