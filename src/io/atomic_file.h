#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>

namespace lightcuts {

/// Throws Error{cannot_write} if `path` could not be written: its folder is missing or takes no new file, it is a folder,
/// or it exists and is read-only. Also refuses a file or folder without any write bit, though root could write it.
void require_writable_place(const std::filesystem::path& path);

/// A file that is either whole or not there: written under a temporary name in the same folder, renamed by commit().
///
/// Destroyed without commit(), it leaves nothing behind and what stood under its name before is unharmed. A symbolic
/// link stays one: its target is replaced. An existing file's permission bits are kept, a new file gets the umask's.
/// Where a device or a pipe stands under the name it is written directly.
class AtomicFile {
 public:
  /// Throws Error{cannot_write, disk_full}.
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Each throws Error{cannot_write, disk_full}; after that, so does commit(), should a caller have swallowed the first.
  void write(std::span<const std::byte> bytes);
  void seek(std::uint64_t offset);
  [[nodiscard]] std::uint64_t tell();

  /// Flushes to the disk, checks, and gives the file its name.
  void commit();

 private:
  void close() noexcept;
  [[noreturn]] void fail(int error_number);

  std::filesystem::path path_;       ///< as the caller named it, for messages
  std::filesystem::path target_;     ///< symbolic links resolved
  std::filesystem::path temporary_;  ///< empty where the target is written directly
  std::FILE* file_ = nullptr;
  int first_error_ = 0;
};

/// Writes `bytes` as the whole file. Throws Error{cannot_write, disk_full}.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace lightcuts
