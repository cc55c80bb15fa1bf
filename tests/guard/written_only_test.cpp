// A visual frame stores into the caller's memory and never loads from it: the memory may be a graphics
// card's.
#include <gtest/gtest.h>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

#ifdef __x86_64__
#include <signal.h>
#include <sys/mman.h>
#include <ucontext.h>

namespace palpate::test {
namespace written_only_test {

// Traps every access to a page: counts the access, single-steps over it, and protects the page again.
class WatchedPage {
 public:
  static constexpr size_t kBytes = 4096;

  WatchedPage() {
    page_ = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    loads_ = stores_ = 0;
    struct sigaction action = {};
    action.sa_flags = SA_SIGINFO;
    action.sa_sigaction = on_access;
    sigaction(SIGSEGV, &action, &old_access_);
    action.sa_sigaction = on_step;
    sigaction(SIGTRAP, &action, &old_step_);
  }
  ~WatchedPage() {
    sigaction(SIGSEGV, &old_access_, nullptr);
    sigaction(SIGTRAP, &old_step_, nullptr);
    munmap(page_, kBytes);
  }
  WatchedPage(const WatchedPage&) = delete;
  WatchedPage& operator=(const WatchedPage&) = delete;

  void watch(bool on) { mprotect(page_, kBytes, on ? PROT_NONE : PROT_READ | PROT_WRITE); }
  pal_real* reals() { return static_cast<pal_real*>(page_); }
  long loads() const { return loads_; }
  long stores() const { return stores_; }

 private:
  static constexpr long kTrapFlag = 0x100;
  static constexpr long kWrite = 2;  // bit of a page fault's error code

  static void on_access(int, siginfo_t*, void* context) {
    auto& registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
    ((registers[REG_ERR] & kWrite) != 0 ? stores_ : loads_) += 1;
    mprotect(page_, kBytes, PROT_READ | PROT_WRITE);
    registers[REG_EFL] |= kTrapFlag;
  }
  static void on_step(int, siginfo_t*, void* context) {
    mprotect(page_, kBytes, PROT_NONE);
    static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_EFL] &= ~kTrapFlag;
  }

  static inline void* page_;
  static inline long loads_;
  static inline long stores_;
  struct sigaction old_access_ = {};
  struct sigaction old_step_ = {};
};

TEST(WrittenOnly, CountsLoadsAndStores) {
  WatchedPage page;
  volatile pal_real* number = page.reals();
  page.watch(true);
  *number = 1;
  *number = *number + 1;
  page.watch(false);
  EXPECT_EQ(page.loads(), 1);
  EXPECT_EQ(page.stores(), 2);
}

TEST(WrittenOnly, HoldsForEveryModel) {
  const OpenPack pack(zone_pack_bytes());
  ASSERT_GE(pack.info().num_nodes, 32U);  // a whole panel
  ASSERT_LE(2 * kNodeBytes * pack.info().num_nodes, WatchedPage::kBytes);
  const std::vector<pal_contact> contacts = {{1, {0, 0, -0.02}, 0, {}, {}, {}},
                                             {6, {0.01, 0, -0.02}, 0, {}, {}, {}}};
  for (const pal_model model : {PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL, PAL_MODEL_ZONE}) {
    for (const size_t count : {size_t{0}, size_t{1}, size_t{2}}) {
      if (model == PAL_MODEL_POLYNOMIAL && count > 1) continue;
      OwnedSession session(pack.get(), model, 2, 0);
      session.touch({contacts.begin(), contacts.begin() + static_cast<std::ptrdiff_t>(count)});
      const std::vector<pal_real> field = session.field();
      for (const size_t stride : {kNodeBytes, 2 * kNodeBytes}) {
        WatchedPage page;
        page.watch(true);
        const pal_status status = pal_visual_frame(session.get(), page.reals(), stride);
        page.watch(false);
        EXPECT_EQ(status, PAL_STATUS_OK);
        EXPECT_EQ(page.loads(), 0) << "model " << model << ", contacts " << count << ", stride " << stride;
        EXPECT_GT(page.stores(), 0);
        EXPECT_EQ(page.reals()[2], field[2]);
      }
    }
  }
}

}  // namespace written_only_test
}  // namespace palpate::test
#endif
