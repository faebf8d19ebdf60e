// The file of impacts of fix lcp/impact: one line for each impact that has ended.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "dembark/impact/types.hpp"

namespace dembark_liggghts {

/// What users see of the second body of a contact: its number, or -1, -2, ... for the first, second, ... wall.
inline std::int64_t outer_id(std::int64_t key) { return key < 0 ? -1 - dembark::impact::wall_number(key) : key; }

/// Appends records and knows how many bytes are right, so that a run which is taken up again from a restart file neither repeats the
/// records written after that file nor loses those written before it. Held by one process.
class ImpactRecord {
 public:
  ~ImpactRecord();
  ImpactRecord() = default;
  ImpactRecord(const ImpactRecord&) = delete;
  ImpactRecord& operator=(const ImpactRecord&) = delete;

  /// kept < 0: a new file with a header, `about` says what the numbers of the walls stand for; otherwise the first `kept` bytes of the
  /// file stay. Returns what is wrong in one line, or an empty string; a file that ends before `kept` is wrong.
  std::string open(const std::string& path, long long kept, const std::string& about);
  bool is_open() const { return file_ != nullptr; }

  /// Writes and flushes; false if the disk does not take it.
  bool write(const std::vector<dembark::impact::Impact>& impacts);
  long long bytes() const { return bytes_; }

 private:
  std::FILE* file_ = nullptr;
  long long bytes_ = 0;
};

}  // namespace dembark_liggghts
