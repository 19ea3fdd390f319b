#include "io/read_file.h"

#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>

#include "lightcuts/error.h"

namespace lightcuts {

std::vector<std::byte> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw Error(Code::file_missing, "'" + path.string() + "' is a folder; name a file in it");
  }
  errno = 0;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (file == nullptr) {
    throw Error(Code::file_missing, "'" + path.string() +
                                        "' cannot be opened: " + std::generic_category().message(errno) +
                                        "; check its path and its permissions");
  }
  const auto too_large = [&] {
    throw Error(Code::unsupported, "'" + path.string() + "' is larger than the " + std::to_string(max_bytes >> 20) +
                                       " MiB that are read of such a file; make it smaller");
  };
  // The size serves as a first guess only: pipes have none, and files change.
  const std::uint64_t expected = std::filesystem::file_size(path, error);
  if (!error && expected > max_bytes) too_large();
  std::vector<std::byte> bytes(error ? 65536 : static_cast<std::size_t>(expected) + 1);
  std::size_t size = 0;
  for (std::size_t count = 1; count > 0; size += count) {
    if (size > max_bytes) too_large();
    if (size == bytes.size()) bytes.resize(2 * size);
    count = std::fread(bytes.data() + size, 1, bytes.size() - size, file.get());
  }
  if (std::ferror(file.get()) != 0) {
    throw Error(Code::file_missing,
                "'" + path.string() + "' cannot be read: " + std::generic_category().message(errno));
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace lightcuts
