// The fixture of tests that expect the .inp reader to refuse a file.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "offline/mesh/inp_reader.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/inp_fixture.hpp"

namespace palpate::inp_refusals_fixture {

using test::with_line;
class InpRefusals : public test::InpFile {};

}  // namespace palpate::inp_refusals_fixture
