#include "offline/output/progress_bar.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <utility>

namespace palpate {
namespace {

constexpr int kWidth = 30;
constexpr auto kQuietStart = std::chrono::seconds(1);
constexpr auto kRedraw = std::chrono::milliseconds(100);

}  // namespace

ProgressBar::ProgressBar(std::string label, int total)
    : label_(std::move(label)), total_(total), on_terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(int done) {
  const Clock::time_point now = Clock::now();
  if (!on_terminal_ || total_ <= 0 || done <= 0 || now - start_ < kQuietStart || now - last_drawn_ < kRedraw)
    return;
  last_drawn_ = now;
  drawn_ = true;
  const double fraction = static_cast<double>(done) / total_;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const int left = static_cast<int>(std::lround(elapsed * (1.0 - fraction) / fraction));
  const auto filled = static_cast<size_t>(fraction * kWidth);
  const std::string line =
      fmt::format("\r\033[K{}  [{}{}]  {}/{}  {}:{:02} left", label_, std::string(filled, '#'),
                  std::string(kWidth - filled, '-'), done, total_, left / 60, left % 60);
  std::fputs(line.c_str(), stderr);  // a lost terminal must not stop the work
  std::fflush(stderr);
}

}  // namespace palpate
