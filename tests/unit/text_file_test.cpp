// Text files that a stranger names: regular files of bounded size, or a message.
#include "offline/mesh/text_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace palpate {
namespace text_file_test {

class TextFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("palpate_text_file_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  std::string content_ = "kept";
};

TEST_F(TextFile, RefusesAPipeWithoutWaiting) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_NE(read_text_file(folder_ / "pipe", content_).find("no regular file"), std::string::npos);
  EXPECT_EQ(content_, "kept");
}

TEST_F(TextFile, RefusesADeviceThatNeverEnds) {
  EXPECT_NE(read_text_file("/dev/zero", content_).find("no regular file"), std::string::npos);
}

TEST_F(TextFile, ReadsUpToTheLimitAndNoFurther) {
  std::ofstream(folder_ / "ten") << "0123456789";
  EXPECT_EQ(read_text_file(folder_ / "ten", content_, 10), "");
  EXPECT_EQ(content_, "0123456789");
  EXPECT_NE(read_text_file(folder_ / "ten", content_, 9).find("larger than 9 bytes"), std::string::npos);
}

}  // namespace text_file_test
}  // namespace palpate
