#include "offline/precompute/sample_store.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "schemas/pack_checksum.hpp"

namespace palpate {
namespace {

struct RecordHeader {
  char magic[8];
  std::uint64_t checksum;  // XXH3-64 of the record after this field, seeded with the binding
  std::uint32_t kind;
  std::int32_t increments;
  double displacement[3];
  std::uint64_t numbers;  // count of float64 after the header
  std::uint64_t fields;   // count of float32 after the numbers
  std::uint64_t outcome;
};
static_assert(sizeof(RecordHeader) == 72);

constexpr char kMagic[8] = {'P', 'A', 'L', 'S', 'M', 'P', '0', '2'};
constexpr size_t kUncheckedBytes = offsetof(RecordHeader, checksum) + sizeof(RecordHeader::checksum);

std::uint64_t checksum_of(std::string_view record, std::uint64_t binding) {
  return XXH3_64bits_withSeed(record.data() + kUncheckedBytes, record.size() - kUncheckedBytes, binding);
}

bool read_at(int file, std::uint64_t offset, void* to, size_t count) {
  auto* bytes = static_cast<char*>(to);
  while (count > 0) {
    const ssize_t got = pread(file, bytes, count, static_cast<off_t>(offset));
    if (got <= 0) return false;
    bytes += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<size_t>(got);
  }
  return true;
}

bool write_at(int file, std::uint64_t offset, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t put = pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (put <= 0) return false;
    bytes.remove_prefix(static_cast<size_t>(put));
    offset += static_cast<std::uint64_t>(put);
  }
  return true;
}

[[noreturn]] void throw_system_error(const std::filesystem::path& path) {
  throw std::runtime_error(path.string() + ": " + std::strerror(errno) +
                           "; name another folder for solved samples with --samples");
}

}  // namespace

const char* words_for(PushOutcome outcome) {
  switch (outcome) {
    case PushOutcome::solved:
      return "an equilibrium was found";
    case PushOutcome::no_equilibrium:
      return "no equilibrium was found";
    case PushOutcome::unstable:
      return "the equilibrium is not stable";
    case PushOutcome::other_branch:
      return "the equilibrium is not on the path from rest";
    case PushOutcome::nearly_inverted:
      return "an element nearly inverts";
    case PushOutcome::not_followed:
      return "polynomials do not follow";
  }
  return "";
}

SampleFile::SampleFile(const std::filesystem::path& path, std::uint64_t binding) : binding_(binding) {
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) throw_system_error(path);
  read_index();
}

SampleFile::~SampleFile() {
  if (file_ >= 0) close(file_);
}

SampleFile::Key SampleFile::key_of(const PushRequest& request) {
  const Eigen::Vector3d& d = request.displacement;
  return {static_cast<std::uint32_t>(request.kind), request.increments, d[0], d[1], d[2]};
}

void SampleFile::read_index() {
  struct stat status = {};
  if (fstat(file_, &status) != 0) return;
  const auto size = static_cast<std::uint64_t>(status.st_size);
  std::string record;
  for (;;) {
    RecordHeader header;
    if (size - end_ < sizeof header || !read_at(file_, end_, &header, sizeof header)) return;
    const std::uint64_t remaining = size - end_ - sizeof header;
    if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 ||
        header.numbers > remaining / sizeof(double) ||
        header.fields > (remaining - header.numbers * sizeof(double)) / sizeof(float))
      return;
    record.resize(sizeof header + header.numbers * sizeof(double) + header.fields * sizeof(float));
    if (!read_at(file_, end_, record.data(), record.size()) ||
        checksum_of(record, binding_) != header.checksum)
      return;
    const double* d = header.displacement;
    places_[{header.kind, header.increments, d[0], d[1], d[2]}] = {
        end_ + sizeof header, header.numbers, header.fields, static_cast<PushOutcome>(header.outcome)};
    end_ += record.size();
  }
}

std::optional<SolvedPush> SampleFile::find(const PushRequest& request, size_t num_numbers,
                                           size_t num_fields) const {
  const auto found = places_.find(key_of(request));
  if (found == places_.end()) return std::nullopt;
  const Place& place = found->second;
  SolvedPush push;
  push.outcome = place.outcome;
  if (push.outcome != PushOutcome::solved) return push;
  if (place.numbers != num_numbers || place.fields != num_fields) return std::nullopt;
  push.numbers.resize(num_numbers);
  push.fields.resize(num_fields);
  if (!read_at(file_, place.offset, push.numbers.data(), num_numbers * sizeof(double)) ||
      !read_at(file_, place.offset + num_numbers * sizeof(double), push.fields.data(),
               num_fields * sizeof(float)))
    return std::nullopt;
  return push;
}

bool SampleFile::keep(const PushRequest& request, const SolvedPush& push) {
  RecordHeader header = {};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.kind = static_cast<std::uint32_t>(request.kind);
  header.increments = request.increments;
  Eigen::Map<Eigen::Vector3d>(header.displacement) = request.displacement;
  header.numbers = push.numbers.size();
  header.fields = push.fields.size();
  header.outcome = static_cast<std::uint64_t>(push.outcome);
  std::string record(sizeof header, '\0');
  std::memcpy(record.data(), &header, sizeof header);
  record.append(reinterpret_cast<const char*>(push.numbers.data()), push.numbers.size() * sizeof(double));
  record.append(reinterpret_cast<const char*>(push.fields.data()), push.fields.size() * sizeof(float));
  const std::uint64_t checksum = checksum_of(record, binding_);
  std::memcpy(record.data() + offsetof(RecordHeader, checksum), &checksum, sizeof checksum);
  if (!write_at(file_, end_, record)) return false;
  places_[key_of(request)] = {end_ + sizeof header, header.numbers, header.fields, push.outcome};
  end_ += record.size();
  return true;
}

SampleStore::SampleStore(const std::filesystem::path& folder, std::string_view inputs,
                         bool is_locked_by_rank_0) {
  const XXH128_hash_t hash = XXH3_128bits(inputs.data(), inputs.size());
  folder_ = folder / fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
  key_ = hash.low64;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error)
    throw std::runtime_error(folder_.string() + ": " + error.message() +
                             "; name another folder for solved samples with --samples");
  if (is_locked_by_rank_0) return;
  const std::filesystem::path lock = folder_ / "lock";
  lock_ = open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) throw_system_error(lock);
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    const int reason = errno;
    close(lock_);
    errno = reason;
    if (reason != EWOULDBLOCK) throw_system_error(lock);
    throw std::runtime_error(
        folder_.string() +
        ": another build of the same scene works in it; wait for it, or name another folder with "
        "--samples");
  }
}

SampleStore::~SampleStore() {
  if (lock_ >= 0) close(lock_);
}

std::uint64_t SampleStore::binding_of(int label) const {
  return XXH3_64bits_withSeed(&label, sizeof label, key_);
}

std::filesystem::path SampleStore::file_of(int label) const {
  return folder_ / fmt::format("{}.samples", label);
}

SampleStore::Place SampleStore::place_of(std::string_view set) const {
  const std::uint64_t hash = XXH3_64bits_withSeed(set.data(), set.size(), key_);
  return {folder_ / fmt::format("set-{:016x}.samples", hash), hash};
}

}  // namespace palpate
