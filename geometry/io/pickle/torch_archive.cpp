// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/torch_archive.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/pickle/pickle.h"
#include "geometry/io/pickle/torch_legacy.h"

namespace holdfast {
namespace {

constexpr std::string_view kPickleName = "data.pkl";

// The pickle of the archive: the one that lies least deep.
const ZipMember* FindPickle(const ZipArchive& archive) {
  const ZipMember* found = nullptr;
  for (const ZipMember& member : archive.Members()) {
    const bool fits = member.name == kPickleName ||
                      (member.name.ends_with(kPickleName) &&
                       member.name[member.name.size() - kPickleName.size() - 1] == '/');
    if (fits && (found == nullptr || member.name.size() < found->name.size())) found = &member;
  }
  return found;
}

class TorchArchive {
 public:
  TorchArchive(const ZipArchive& archive, const ZipMember& pickle)
      : archive_(archive),
        pickle_(pickle),
        folder_(pickle.name.substr(0, pickle.name.size() - kPickleName.size())),
        budget_(DataStore::DefaultLimit(static_cast<std::size_t>(archive.Source().Size()))) {}

  DataValue Read() {
    if (Find("constants.pkl") != nullptr) {
      throw Error(archive_.Source().Name(), "is a TorchScript program, which is code",
                  "Save its state_dict() with torch.save");
    }
    big_endian_ = IsBigEndian();
    PickleOptions options;
    options.limits.max_memory = budget_;
    options.storage = [this](const TorchStorageRequest& request) { return Storage(request); };
    options.nested_torch_file = [this](std::span<const std::byte> file, ElementType& element) {
      return ReadNestedTorchStorage(file, archive_.Source().Name(), element);
    };
    return ReadPickle(OwnBytes(Take(pickle_)), archive_.Source().Name(), options);
  }

 private:
  const ZipMember* Find(std::string_view name) const {
    return archive_.Find(fmt::format("{}{}", folder_, name));
  }

  std::string Where(const ZipMember& member) const {
    return fmt::format("{}[{}]", archive_.Source().Name(), member.name);
  }

  // Members may lie over each other in a hostile file: all of them together are bounded.
  std::vector<std::byte> Take(const ZipMember& member) {
    std::vector<std::byte> data = archive_.Read(member, Where(member), budget_);
    budget_ -= data.size();
    return data;
  }

  bool IsBigEndian() {
    const ZipMember* member = Find("byteorder");
    if (member == nullptr) return false;
    constexpr std::uint64_t kLongest = 16;
    const std::vector<std::byte> text = archive_.Read(*member, Where(*member), kLongest);
    const std::string_view order(reinterpret_cast<const char*>(text.data()), text.size());
    if (order == "little") return false;
    if (order == "big") return true;
    throw Error(Where(*member), "names no byte order", "The file is damaged: save it again");
  }

  DataBytes Storage(const TorchStorageRequest& request) {
    const ZipMember* member = Find(fmt::format("data/{}", request.key));
    if (member == nullptr) {
      throw Error(archive_.Source().Name(),
                  fmt::format("has no storage '{}data/{}', which a tensor needs", folder_,
                              request.key.substr(0, 80)),
                  "The file is damaged: save it again");
    }
    std::vector<std::byte> data = Take(*member);
    const std::size_t size = request.element.size;
    if (big_endian_ && size > 1) {
      for (std::size_t i = 0; i + size <= data.size(); i += size) {
        std::reverse(data.begin() + static_cast<std::ptrdiff_t>(i),
                     data.begin() + static_cast<std::ptrdiff_t>(i + size));
      }
    }
    return OwnBytes(std::move(data));
  }

  const ZipArchive& archive_;
  const ZipMember& pickle_;
  std::string folder_;  // with its slash
  std::size_t budget_;
  bool big_endian_ = false;
};

}  // namespace

bool IsTorchArchive(const ZipArchive& archive) { return FindPickle(archive) != nullptr; }

DataValue ReadTorchArchive(const ZipArchive& archive) {
  const ZipMember* pickle = FindPickle(archive);
  if (pickle == nullptr) {
    throw Error(archive.Source().Name(), "has no data.pkl, as files of torch.save do",
                "Give a file written by torch.save");
  }
  return TorchArchive(archive, *pickle).Read();
}

}  // namespace holdfast
