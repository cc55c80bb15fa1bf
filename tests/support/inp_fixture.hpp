// Messages of the .inp reader for a small model file and for changed copies of the file.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/support/inp_text.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {

class InpFile : public ::testing::Test {
 protected:
  Model read(const std::string& text) const { return read_inp(dir_.write("organ.inp", text)); }

  // The message without the path of the test's folder.
  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const InputError& error) {
      return without_folder(error.what());
    }
    return "accepted";
  }

  std::string without_folder(std::string message) const { return dir_.without_folder(std::move(message)); }

  TempDir dir_;
};

}  // namespace palpate::test
