#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <random>
#include <string>
#include <system_error>
#include <utility>

#include "lightcuts/error.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;

std::string quoted(const fs::path& path) { return "'" + path.string() + "'"; }

std::string reason(int error_number) { return std::generic_category().message(error_number); }

[[noreturn]] void throw_write_error(const fs::path& path, int error_number) {
  // A quota and a limit on the size of files are a full disk to the one who writes.
  if (error_number == ENOSPC || error_number == EDQUOT || error_number == EFBIG) {
    throw Error(Code::disk_full, quoted(path) + " cannot be written: " + reason(error_number) +
                                     "; free some space or choose another folder (nothing was left behind)");
  }
  throw Error(Code::cannot_write, quoted(path) + " cannot be written: " + reason(error_number));
}

/// Follows symbolic links of the last component, also to a target that does not exist yet.
fs::path resolve_links(const fs::path& path) {
  constexpr int kMaxLinks = 40;
  fs::path target = path;
  std::error_code error;
  for (int i = 0; fs::is_symlink(fs::symlink_status(target, error)); ++i) {
    if (i == kMaxLinks) throw_write_error(path, ELOOP);
    const fs::path next = fs::read_symlink(target, error);
    if (error) throw_write_error(path, error.value());
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

fs::path folder_of(const fs::path& target) { return target.has_parent_path() ? target.parent_path() : fs::path("."); }

/// Root passes every permission check, so a file that its owner protected is told by its mode bits.
bool may_write(const fs::path& place, const struct stat& info) {
  constexpr mode_t kAnyWriteBit = S_IWUSR | S_IWGRP | S_IWOTH;
  return (info.st_mode & kAnyWriteBit) != 0 && faccessat(AT_FDCWD, place.c_str(), W_OK, AT_EACCESS) == 0;
}

void require_folder(const fs::path& path, const fs::path& folder) {
  struct stat info {};
  if (stat(folder.c_str(), &info) != 0) {
    if (errno != ENOENT) throw_write_error(path, errno);
    throw Error(Code::cannot_write, quoted(path) + " cannot be written: the folder " + quoted(folder) +
                                        " does not exist; create it first (mkdir -p) or choose another");
  }
  if (!S_ISDIR(info.st_mode)) {
    throw Error(Code::cannot_write,
                quoted(path) + " cannot be written: " + quoted(folder) + " is a file, not a folder; choose another");
  }
  if (!may_write(folder, info)) {
    throw Error(Code::cannot_write, quoted(path) + " cannot be written: the folder " + quoted(folder) +
                                        " takes no new files (no permission, or a read-only disk); choose another");
  }
}

/// What stands under the target's name: st_mode, or 0 if nothing does.
struct stat existing_file(const fs::path& path, const fs::path& target) {
  struct stat info {};
  if (stat(target.c_str(), &info) != 0) {
    if (errno != ENOENT && errno != ENOTDIR) throw_write_error(path, errno);
    return {};
  }
  if (S_ISDIR(info.st_mode)) {
    throw Error(Code::cannot_write, quoted(path) + " cannot be written: it is a folder; name a file inside it");
  }
  if (!may_write(target, info)) {
    throw Error(
        Code::cannot_write,
        quoted(path) + " exists and is read-only; make it writable (chmod u+w), remove it or choose another name");
  }
  return info;
}

bool is_special(const struct stat& info) { return info.st_mode != 0 && !S_ISREG(info.st_mode); }

/// Short and without the target's name, so that it fits wherever the target's fits.
fs::path temporary_name(const fs::path& folder) {
  std::random_device random;
  const std::uint64_t number = (std::uint64_t{random()} << 32) | random();
  return folder / (".lightcuts-" + std::to_string(getpid()) + "-" + std::to_string(number) + ".tmp");
}

}  // namespace

void require_writable_place(const fs::path& path) {
  const fs::path target = resolve_links(path);
  if (!target.has_filename()) {
    throw Error(Code::cannot_write, quoted(path) + " cannot be written: it names a folder; name a file inside it");
  }
  if (!is_special(existing_file(path, target))) require_folder(path, folder_of(target));
}

AtomicFile::AtomicFile(const fs::path& path) : path_(path), target_(resolve_links(path)) {
  require_writable_place(path);
  const struct stat existing = existing_file(path_, target_);

  int descriptor = -1;
  if (is_special(existing)) {
    descriptor = open(target_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    do {
      temporary_ = temporary_name(folder_of(target_));
      descriptor = open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
    } while (descriptor < 0 && errno == EEXIST);
  }
  if (descriptor < 0) {
    temporary_.clear();
    throw_write_error(path_, errno);
  }
  if (!temporary_.empty() && existing.st_mode != 0) {
    // Best effort: another user's file system may refuse either, and the picture matters more.
    if (fchown(descriptor, existing.st_uid, existing.st_gid) != 0) errno = 0;
    if (fchmod(descriptor, existing.st_mode & 07777) != 0) errno = 0;
  }
  file_ = fdopen(descriptor, "wb");
  if (file_ == nullptr) {
    const int error_number = errno;
    ::close(descriptor);
    close();
    throw_write_error(path_, error_number);
  }
}

AtomicFile::~AtomicFile() { close(); }

void AtomicFile::close() noexcept {
  if (file_ != nullptr) std::fclose(file_);
  file_ = nullptr;
  if (!temporary_.empty()) unlink(temporary_.c_str());
  temporary_.clear();
}

void AtomicFile::fail(int error_number) {
  if (first_error_ == 0) first_error_ = error_number == 0 ? EIO : error_number;
  throw_write_error(path_, first_error_);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(errno);
}

void AtomicFile::seek(std::uint64_t offset) {
  if (fseeko(file_, static_cast<off_t>(offset), SEEK_SET) != 0) fail(errno);
}

std::uint64_t AtomicFile::tell() {
  const off_t offset = ftello(file_);
  if (offset < 0) fail(errno);
  return static_cast<std::uint64_t>(offset);
}

void AtomicFile::commit() {
  if (first_error_ != 0) fail(first_error_);
  if (std::fflush(file_) != 0) fail(errno);
  // Some file systems find out that they are full only here. Devices and pipes cannot be synchronised.
  if (!temporary_.empty() && fsync(fileno(file_)) != 0) fail(errno);
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail(errno);
  if (temporary_.empty()) return;
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
  temporary_.clear();
}

void write_file(const fs::path& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace lightcuts
