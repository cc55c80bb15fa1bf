// Checks the address space for the buffers of BLAS.
#pragma once

#include <string>

namespace palpate {

// Returns one line with the shortage and the remedy, or "". OpenBLAS maps a buffer of 128 MiB for each of its
// threads at load time. Without room the threads retry for ever, and the end of the process waits for them:
// after a shortage, leave by std::_Exit.
std::string address_space_shortage();

}  // namespace palpate
