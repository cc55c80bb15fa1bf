// Page of linear_dd on the brain: times and errors of forces, fields, and joining and leaving contacts.
#include <cstring>

#include "bench/peers/method_frames.hpp"
#include "bench/peers/peers.hpp"
#include "bench/peers/site_sets.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate::peers {
namespace {

using Sites = std::vector<std::uint32_t>;

constexpr size_t kSpareSites = 8;  // sites of the pool beyond the contacts held at once
constexpr int kColdFrames = 150;

class BrainSession {
 public:
  explicit BrainSession(const LinearOrgan& organ, std::uint32_t max_contacts)
      : organ_(&organ), session_(organ, max_contacts) {}

  // Sets the contacts of the next frame.
  void set(const Sites& sites) {
    if (contacts_.size() != sites.size()) contacts_.resize(sites.size());
    d_ = circling(frame_++, sites.size(), Motion::each_its_own, 1.0);
    for (size_t c = 0; c < sites.size(); ++c) contacts_[c].site = sites[c];
    displace(d_, contacts_);
  }
  void force_frame() { session_.contact_frame(contacts_); }
  void field_frame() { session_.visual_frame(); }

  // Adds the errors of the last frame.
  void check(Errors& errors) {
    session_.visual_frame();
    std::vector<int> nodes;
    for (const pal_contact& contact : contacts_) nodes.push_back(organ_->site_node(contact.site));
    const ExactAnswer exact(organ_->assembly, nodes, d_);
    errors.add(session_.field().cast<double>() - exact.shown(organ_->sites), d_,
               session_.force(contacts_.size()) - exact.force, exact.force);
  }

 private:
  const LinearOrgan* organ_;
  LinearSession session_;
  std::vector<pal_contact> contacts_;
  Eigen::VectorXd d_;
  int frame_ = 0;
};

std::vector<std::string> time_cells(const FrameTimes& times) {
  return {in_us(times.median()), in_us(times.at(0.999)), in_us(times.at(1))};
}
std::vector<std::string> error_cells(const Errors& errors) {
  return {fmt::format("{:.1e}", errors.displacement), fmt::format("{:.1e}", errors.force)};
}
std::vector<std::string> join(std::initializer_list<std::vector<std::string>> parts) {
  std::vector<std::string> cells;
  for (const std::vector<std::string>& part : parts) cells.insert(cells.end(), part.begin(), part.end());
  return cells;
}
std::string bar_cell(double bar) {
  return bar > 0 ? in_us(bar) : "";
}

// ---------------------------------------------------------------- forces

// Bars: the times that a row should stay below, us; 0: no bar.
struct Bars {
  size_t contacts;
  double force;
  double joining;
};
constexpr Bars kBars[] = {{1, 0.2, 0}, {3, 0.5, 0}, {8, 2.5, 2}, {32, 0, 12}};

void add_force_row(const LinearOrgan& brain, const Bars& bars, const Sites& patch, const Study& study,
                   CacheEvictor& evictor, study::StudyTable& table) {
  BrainSession session(brain, static_cast<std::uint32_t>(bars.contacts));
  const Sites sites(patch.begin(), patch.begin() + static_cast<std::ptrdiff_t>(bars.contacts));
  Errors errors;
  FrameTimes warm;
  const int frames = study.patient ? 1000000 : 100000;
  for (int i = -1000; i < frames; ++i) {
    session.set(sites);
    if (i < 0) {
      session.force_frame();
    } else {
      warm.time([&] { session.force_frame(); });
    }
  }
  session.check(errors);
  FrameTimes cold;
  for (int i = 0; i < kColdFrames; ++i) {
    session.set(sites);
    evictor.evict();
    cold.time([&] { session.force_frame(); });
  }
  session.check(errors);
  table.add(join({{std::to_string(bars.contacts)},
                  time_cells(warm),
                  {bar_cell(bars.force), in_us(cold.median()), in_us(cold.at(1))},
                  error_cells(errors)}));
}

// ---------------------------------------------------------------- fields

void add_field_row(const LinearOrgan& brain, const Bars& bars, const Sites& patch, const Study& study,
                   CacheEvictor& evictor, study::StudyTable& table) {
  BrainSession session(brain, static_cast<std::uint32_t>(bars.contacts));
  session.set(Sites(patch.begin(), patch.begin() + static_cast<std::ptrdiff_t>(bars.contacts)));
  session.force_frame();
  Errors errors;
  session.check(errors);
  const size_t rows = static_cast<size_t>(3 * brain.num_shown());
  const size_t bytes = pack::num_panels(static_cast<std::uint32_t>(brain.num_shown())) * size_t{3} *
                       pack::kPanelRows * sizeof(pal_real) * bars.contacts;
  std::vector<unsigned char> from(bytes, 1);
  std::vector<unsigned char> to(bytes, 2);
  const auto copy = [&] {
    std::memcpy(to.data(), from.data(), bytes);
    asm volatile("" : : "r"(to.data()) : "memory");
  };
  const auto field = [&] { session.field_frame(); };
  // Field and memcpy alternate in blocks under the same load. Uncounted calls first refill the caches.
  constexpr int kBlocks = 40;
  const int frames = (study.patient ? 100000 : 20000) / kBlocks;
  FrameTimes warm, warm_copy, cold, cold_copy;
  for (int block = 0; block < kBlocks; ++block) {
    for (int i = -frames / 10; i < frames; ++i) i < 0 ? field() : warm.time(field);
    for (int i = -frames / 10; i < frames; ++i) i < 0 ? copy() : warm_copy.time(copy);
  }
  for (int i = 0; i < kColdFrames; ++i) {
    evictor.evict();
    cold.time(field);
    evictor.evict();
    cold_copy.time(copy);
  }
  const double per_row = 1000.0 / static_cast<double>(rows * bars.contacts);
  table.add(
      join({{std::to_string(bars.contacts), fmt::format("{:.0f}", static_cast<double>(bytes) / 1024)},
            time_cells(warm),
            {in_us(warm_copy.median()), fmt::format("{:.2f}", warm.median() / warm_copy.median()),
             fmt::format("{:.3f}", warm.median() * per_row), in_us(cold.median()), in_us(cold_copy.median()),
             fmt::format("{:.2f}", cold.median() / cold_copy.median()), error_cells(errors).front()}}));
}

// --------------------------------------------------------------- changes

// Times of contacts that move through a pool of sites: a contact joins, then the oldest leaves. The pool is
// so large that no set repeats while the session keeps its data.
struct ChangeTimes {
  FrameTimes joining, leaving;
  Errors after_joining, after_leaving;
};

ChangeTimes time_changes(const LinearOrgan& brain, size_t held, const Sites& pool, int cycles,
                         CacheEvictor* evictor) {
  BrainSession session(brain, static_cast<std::uint32_t>(held + 1));
  ChangeTimes change;
  Sites sites(pool.begin(), pool.begin() + static_cast<std::ptrdiff_t>(held));
  size_t next = held;
  const auto join_next = [&] { sites.push_back(pool[next++ % pool.size()]); };
  const auto frame = [&](FrameTimes* times) {
    session.set(sites);
    if (evictor != nullptr) evictor->evict();
    if (times == nullptr) {
      session.force_frame();
    } else {
      times->time([&] { session.force_frame(); });
    }
  };
  frame(nullptr);
  const int warm_up = evictor != nullptr ? 1 : 200;
  constexpr int kChecked = 3;  // the last cycles, which have the rounding of all changes before
  for (int cycle = -warm_up; cycle < cycles + kChecked; ++cycle) {
    const bool timed = cycle >= 0 && cycle < cycles;
    join_next();
    frame(timed ? &change.joining : nullptr);
    if (cycle >= cycles) session.check(change.after_joining);
    // Every fourth change repairs rounding. Extra changes let the repair meet both joins and leaves.
    if (cycle % 7 == 0) {
      sites.erase(sites.begin());
      join_next();
      frame(nullptr);
    }
    sites.erase(sites.begin());
    frame(timed ? &change.leaving : nullptr);
    if (cycle >= cycles) session.check(change.after_leaving);
  }
  return change;
}

void add_change_rows(const LinearOrgan& brain, const Bars& bars, const Sites& patch, const Study& study,
                     CacheEvictor& evictor, study::StudyTable& table) {
  const size_t held = bars.contacts;
  const int cycles = (study.patient ? 200000 : 20000) / (held > 8 ? 2 : 1);
  const Sites near(patch.begin(), patch.begin() + static_cast<std::ptrdiff_t>(held + kSpareSites));
  const Sites anywhere = random_sites(brain.num_sites(), brain.num_sites(), 1);
  const auto add = [&](const char* where, const ChangeTimes& change, double bar) {
    const auto row = [&](const char* what, const FrameTimes& times, double row_bar, const Errors& errors) {
      table.add(join({{std::to_string(held), what, where, in_us(times.median()), in_us(times.at(0.9)),
                       in_us(times.at(0.999)), in_us(times.at(1)), bar_cell(row_bar)},
                      error_cells(errors)}));
    };
    row("comes", change.joining, bar, change.after_joining);
    row("goes", change.leaving, 0, change.after_leaving);
  };
  add("warm", time_changes(brain, held, near, cycles, nullptr), bars.joining);
  add("anywhere", time_changes(brain, held, anywhere, cycles, nullptr), 0);
  add("cold", time_changes(brain, held, near, kColdFrames, &evictor), 0);
}

}  // namespace

std::vector<study::StudyTable> brain_frames_page(const LinearOrgan& brain, const Study& study) {
  CacheEvictor evictor;
  study::StudyTable forces(
      "brain_forces",
      fmt::format("A frame of forces (`pal_contact_frame`) with k contacts held, us; "
                  "reading the clock, {:.3f} us, is part of every time.",
                  clock_microseconds()),
      {"k", "median", "p99.9", "max", "bar", "cold median", "cold max", "displacement error", "force error"});
  study::StudyTable fields(
      "brain_fields",
      fmt::format("The field of the {} nodes of the surface (`pal_visual_frame`), us, and a memcpy of as "
                  "many bytes as it reads, by turns.",
                  brain.num_shown()),
      {"k", "KB read", "median", "p99.9", "max", "memcpy", "times memcpy (bar 1.3)",
       "us / (1000 rows k) (bar 0.2)", "cold median", "cold memcpy", "times cold memcpy",
       "displacement error"});
  study::StudyTable changes(
      "brain_changes",
      "A frame of forces in which a contact node comes (k to k + 1) or goes (k + 1 to k), us.",
      {"k", "contact", "caches", "median", "p90", "p99.9", "max", "bar", "displacement error",
       "force error"});
  const Sites patch = SiteRings(brain, site_at(brain, kPushedLabel)).sites;
  for (const Bars& bars : kBars) {
    std::fprintf(stderr, "brain, %zu contacts\n", bars.contacts);
    add_force_row(brain, bars, patch, study, evictor, forces);
    add_field_row(brain, bars, patch, study, evictor, fields);
    add_change_rows(brain, bars, patch, study, evictor, changes);
  }
  return {forces, fields, changes};
}

}  // namespace palpate::peers
