// SPDX-License-Identifier: MIT
#include "geometry/io/container/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::size_t kLargestRead = std::size_t{1} << 30;  // Linux reads less than 2^31 at once

}  // namespace

ByteSource::ByteSource(const std::filesystem::path& path) : name_(path.string()) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  const int reason = errno;
  const auto refuse = [&](std::string_view problem, std::string_view remedy) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw Error(name_, problem, remedy);
  };
  if (descriptor_ < 0 && (reason == ENOENT || reason == ENOTDIR)) {
    refuse("does not exist", "Check the path");
  }
  if (descriptor_ < 0 && reason == ELOOP) refuse("is a loop of symbolic links", "Check the path");
  if (descriptor_ < 0) {
    refuse(fmt::format("cannot be opened ({})", std::strerror(reason)), "Check the permissions");
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) refuse("cannot be read", "Check the path");
  if (S_ISDIR(status.st_mode)) refuse("is a folder, a file is needed", "Name the file inside it");
  if (!S_ISREG(status.st_mode)) refuse("is not a regular file", "Save it to a file first");
  if (status.st_size == 0) refuse("is empty", "Copy or save it again");
  size_ = static_cast<std::uint64_t>(status.st_size);
}

ByteSource::ByteSource(std::span<const std::byte> bytes, std::string name)
    : name_(std::move(name)), size_(bytes.size()), memory_(bytes.data()) {}

ByteSource::~ByteSource() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

ByteSource::ByteSource(ByteSource&& other) noexcept
    : name_(std::move(other.name_)),
      size_(std::exchange(other.size_, 0)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      memory_(std::exchange(other.memory_, nullptr)) {}

ByteSource& ByteSource::operator=(ByteSource&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(size_, other.size_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(memory_, other.memory_);
  return *this;
}

void ByteSource::ReadAt(std::uint64_t offset, std::span<std::byte> target) const {
  const auto cut_off = [&] {
    return Error(name_, fmt::format("ends at byte {}, before all of its data", size_),
                 "It is cut off: copy or save it again");
  };
  if (offset > size_ || target.size() > size_ - offset) throw cut_off();
  if (target.empty()) return;
  if (descriptor_ < 0) {
    std::memcpy(target.data(), memory_ + offset, target.size());
    return;
  }
  while (!target.empty()) {
    const auto got = ::pread(descriptor_, target.data(), std::min(target.size(), kLargestRead),
                             static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      throw Error(name_, fmt::format("cannot be read ({})", std::strerror(errno)),
                  "Check the disk");
    }
    if (got == 0) throw cut_off();  // someone cut it while we read
    offset += static_cast<std::uint64_t>(got);
    target = target.subspan(static_cast<std::size_t>(got));
  }
}

std::string ByteSource::Head(std::size_t count) const {
  std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(count, size_)), '\0');
  ReadAt(0, std::as_writable_bytes(std::span(head)));
  return head;
}

std::string ByteSource::Text(std::size_t limit_bytes) const {
  if (size_ > limit_bytes) {
    throw Error(name_, fmt::format("is larger than {} bytes", limit_bytes),
                "Is this the right file?");
  }
  return Head(static_cast<std::size_t>(size_));
}

}  // namespace holdfast
