// Nonlinear solves kept on disk, so that a build that was killed goes on where it was, and one with another target,
// degree or precision solves nothing twice.
//
//   FOLDER/KEY/LABEL.samples     KEY: hash of all that the solves of a scene depend on; LABEL: the site's node
//   FOLDER/KEY/set-HASH.samples  a set of several contacts; HASH: of its sites and displacements
//
// A file is a sequence of records, each with its checksum; what a kill or a full disk left half written at its end is
// not seen, and overwritten. Fields are kept in single precision, 7 digits, and used so by whoever solved them: a build
// that resumes makes the same bytes as one that was never stopped.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace palpate {

// What a solve was asked for.
struct PushRequest {
  enum class Kind : std::uint32_t { sample = 1, survey = 2, series = 3, set = 4 };
  Kind kind = Kind::sample;
  int increments = 0;                                      // of a survey's path from rest
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // of a set: of its first contact
};

enum class PushOutcome : std::uint32_t {
  solved,
  no_equilibrium,   // none was found
  unstable,         // it is not stable
  other_branch,     // it is not the one that the straight path from rest leads to
  nearly_inverted,  // det F of some element is below kLeastSampledJacobian
  not_followed,     // it was solved, and polynomials do not follow it
};

// "no equilibrium was found", ...
const char* words_for(PushOutcome outcome);

// What came of it.
struct SolvedPush {
  PushOutcome outcome = PushOutcome::no_equilibrium;
  std::vector<double> numbers;
  std::vector<float> fields;
};

// The solves of one site, or of one set of contacts. Not thread-safe.
class SampleFile {
 public:
  // Reads what is there and was kept under the same `binding`: what else it depends on. Throws std::runtime_error
  // "PATH: REASON" when it cannot be opened for reading and writing.
  explicit SampleFile(const std::filesystem::path& path, std::uint64_t binding = 0);
  ~SampleFile();
  SampleFile(const SampleFile&) = delete;
  SampleFile& operator=(const SampleFile&) = delete;

  // The answer kept for exactly this request, with so many numbers and fields where it was solved.
  std::optional<SolvedPush> find(const PushRequest& request, size_t num_numbers, size_t num_fields) const;
  // False where it cannot be kept, on a full disk for one; nothing else happens then.
  [[nodiscard]] bool keep(const PushRequest& request, const SolvedPush& push);

 private:
  struct Place {
    std::uint64_t offset, numbers, fields;
    PushOutcome outcome;
  };
  using Key = std::tuple<std::uint32_t, int, double, double, double>;
  static Key key_of(const PushRequest& request);
  void read_index();

  std::uint64_t binding_;
  int file_ = -1;
  std::uint64_t end_ = 0;  // of the last whole record
  std::map<Key, Place> places_;
};

// The folder of one scene's solves, held by one process at a time, or by it for others that it works with. `find` and
// `keep` of its files may go on at once on several threads, one a file.
class SampleStore {
 public:
  // Makes the folder. `key_of` is hashed. Throws std::runtime_error "PATH: REASON; REMEDY" where it cannot be made or
  // another process holds it, unless it does so for this one.
  SampleStore(const std::filesystem::path& folder, std::string_view key_of, bool is_held_for_us = false);
  ~SampleStore();
  SampleStore(const SampleStore&) = delete;
  SampleStore& operator=(const SampleStore&) = delete;

  std::filesystem::path file_of(int label) const;
  std::uint64_t binding_of(
      int label) const;  // a file of another site or scene, copied here, is not taken for it

  // Of a set of several contacts, told from others by these bytes.
  struct Place {
    std::filesystem::path file;
    std::uint64_t binding;
  };
  Place place_of(std::string_view set) const;

 private:
  std::filesystem::path folder_;
  std::uint64_t key_ = 0;
  int lock_ = -1;
};

}  // namespace palpate
