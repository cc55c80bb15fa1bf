// Keeps nonlinear solves on disk, for a resumed build or a build with another target, degree or precision.
//
//   FOLDER/KEY/LABEL.samples     KEY: hash of all inputs of a scene's solves; LABEL: the site's node
//   FOLDER/KEY/set-HASH.samples  a set of several contacts; HASH: of its sites and displacements
//
// A file is a sequence of records with checksums. An incomplete record at the end is overwritten. Fields have
// single precision, also in the run that solved the push: resumed and uninterrupted builds give equal bytes.
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

// A requested solve.
struct PushRequest {
  enum class Kind : std::uint32_t { sample = 1, survey = 2, series = 3, set = 4 };
  Kind kind = Kind::sample;
  int increments = 0;                                      // of a survey's path from rest
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // for a set: displacement of the first contact
};

enum class PushOutcome : std::uint32_t {
  solved,
  no_equilibrium,   // no equilibrium found
  unstable,         // the equilibrium is unstable
  other_branch,     // the equilibrium is not on the straight path from rest
  nearly_inverted,  // det F of an element is below kLeastSampledJacobian
  not_followed,     // solved, but polynomials do not fit
};

// "no equilibrium was found", ...
const char* words_for(PushOutcome outcome);

// The result of a request.
struct SolvedPush {
  PushOutcome outcome = PushOutcome::no_equilibrium;
  std::vector<double> numbers;  // energy, forces and their derivatives
  std::vector<float> fields;    // displacements and their derivatives
};

// The solves of one site or one set of contacts. Not thread-safe.
class SampleFile {
 public:
  // Reads the records kept under the same `binding`, a hash of further inputs. Throws std::runtime_error
  // "PATH: REASON" where the file cannot be opened for reading and writing.
  explicit SampleFile(const std::filesystem::path& path, std::uint64_t binding = 0);
  ~SampleFile();
  SampleFile(const SampleFile&) = delete;
  SampleFile& operator=(const SampleFile&) = delete;

  // Returns the kept result of exactly this request with these numbers of entries.
  std::optional<SolvedPush> find(const PushRequest& request, size_t num_numbers, size_t num_fields) const;
  // Appends a record. Returns false, without other effect, where writing fails, as on a full disk.
  [[nodiscard]] bool keep(const PushRequest& request, const SolvedPush& push);

 private:
  struct Place {
    std::uint64_t offset, numbers, fields;  // offset of the numbers in the file: bytes; counts of both arrays
    PushOutcome outcome;
  };
  using Key = std::tuple<std::uint32_t, int, double, double, double>;
  static Key key_of(const PushRequest& request);
  void read_index();

  std::uint64_t binding_;
  int file_ = -1;
  std::uint64_t end_ = 0;  // end of the last whole record
  std::map<Key, Place> places_;
};

// The folder of a scene's solves. A process holds the folder, for itself or for its ranks. Several threads
// may use `find` and `keep`, each with its own file.
class SampleStore {
 public:
  // Makes FOLDER/KEY, KEY a hash of `inputs`. Throws std::runtime_error "PATH: REASON; REMEDY" where the
  // folder cannot be made or another build holds its lock. `is_locked_by_rank_0`: takes no lock.
  SampleStore(const std::filesystem::path& folder, std::string_view inputs, bool is_locked_by_rank_0 = false);
  ~SampleStore();
  SampleStore(const SampleStore&) = delete;
  SampleStore& operator=(const SampleStore&) = delete;

  std::filesystem::path file_of(int label) const;
  std::uint64_t binding_of(int label) const;  // hash of KEY and the site's label

  // File of a set of several contacts. `set`: bytes that identify the set.
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
