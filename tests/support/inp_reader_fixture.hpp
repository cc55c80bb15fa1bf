// The fixture of tests that expect the .inp reader to accept a file.
#pragma once

#include "offline/mesh/inp_reader.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <sstream>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/inp_fixture.hpp"

namespace palpate::inp_reader_fixture {

using test::kBody;
using test::kEnd;
using test::kStep;
using test::with_line;
class InpReader : public test::InpFile {};

}  // namespace palpate::inp_reader_fixture
