// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/torch_archive.h"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/pickle/pickle.h"

namespace holdfast {
namespace {

constexpr std::string_view kPickleName = "data.pkl";

// Finds the pickle of the archive: the one in the topmost folder.
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
    options.max_memory = budget_;
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

  // Members may overlap in a hostile file: their total size is bounded.
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
    throw Error(Where(*member), "does not state its byte order",
                "The file is damaged: save it again");
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

namespace {

// 0x1950a86a20f9469cfc6c, as pickle protocols 2 and up write it (LONG1, ten bytes, STOP) and as
// protocol 0 does.
constexpr std::string_view kMagic("\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.", 13);
constexpr std::string_view kTextMagic("L119547037146038801333356L\n.");
constexpr std::size_t kMagicWithin = 64;
constexpr std::int64_t kProtocol = 1001;

// Returns where the magic number's pickle ends; nullopt if the bytes begin otherwise.
std::optional<std::size_t> EndOfMagic(std::span<const std::byte> bytes) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kMagicWithin));
  for (const std::string_view magic : {kMagic, kTextMagic}) {
    const auto at = head.find(magic);
    // Before it: nothing, a protocol (2 bytes), or a protocol and a frame (11 bytes).
    if (at == 0 || at == 2 || at == 11) return at + magic.size();
  }
  return std::nullopt;
}

struct PlacedStorage {
  TorchStorageRequest request;
  DataBytes bytes;
};

class LegacyReader {
 public:
  LegacyReader(DataBytes file, const std::string& where) : file_(std::move(file)), where_(where) {}

  DataValue Read() {
    const auto begin = EndOfMagic(file_.view);
    if (!begin) {
      throw Error(where_, "does not begin as a file of torch.save does", "Check the file");
    }
    at_ = *begin;
    const DataValue protocol = NextPickle({});
    if (protocol.Kind() != DataKind::kInteger || protocol.Integer() != kProtocol) {
      Damaged("another protocol than 1001");
    }
    const DataValue machine = NextPickle({});
    if (const auto little = machine.Find("little_endian"); little && little->Number() == 0.0) {
      throw Error(where_, "was written on a big-endian machine",
                  "Load it in torch and save it again");
    }
    // The storages follow the object and the list of their names, one after the other, and only the
    // object states the size of a number: a first reading determines the sizes, a second one takes
    // the numbers from their positions.
    const std::size_t object = at_;
    NextPickle([this](const TorchStorageRequest& request) { return Note(request); });
    const DataValue names = NextPickle({});
    for (std::size_t i = 0; i < names.Size(); ++i) Place(names[i].Text());
    at_ = object;
    return NextPickle([this](const TorchStorageRequest& request) { return Take(request); });
  }

  const std::map<std::string, PlacedStorage>& Storages() const { return storages_; }

 private:
  [[noreturn]] void Damaged(std::string_view detail) const {
    throw Error(where_, fmt::format("is damaged or cut off ({})", detail),
                "Copy or save the file again");
  }

  DataValue NextPickle(std::function<DataBytes(const TorchStorageRequest&)> storage) {
    if (at_ >= file_.view.size()) Damaged("ends too early");
    PickleOptions options;
    options.max_memory = DataStore::DefaultLimit(file_.view.size());
    options.storage = std::move(storage);
    std::size_t bytes_read = 0;
    DataValue value =
        ReadPickle({file_.view.subspan(at_), file_.owner}, where_, options, &bytes_read);
    at_ += bytes_read;
    return value;
  }

  std::size_t BytesOf(const TorchStorageRequest& request) const {
    if (request.element.size == 0 || request.count > file_.view.size() / request.element.size) {
      Damaged(fmt::format("a storage of {} numbers", request.count));
    }
    return static_cast<std::size_t>(request.count) * request.element.size;
  }

  // First reading: any bytes will do, since none is used.
  DataBytes Note(const TorchStorageRequest& request) {
    storages_[request.key].request = request;
    return {file_.view.first(BytesOf(request)), file_.owner};
  }

  void Place(const std::string& key) {
    const auto found = storages_.find(key);
    if (found == storages_.end()) Damaged("a storage that no tensor uses");
    std::array<std::byte, 8> field{};
    if (file_.view.size() - at_ < field.size()) Damaged("ends too early");
    std::copy_n(file_.view.begin() + static_cast<std::ptrdiff_t>(at_), field.size(), field.begin());
    at_ += field.size();
    const auto count = std::bit_cast<std::uint64_t>(field);
    if (count != found->second.request.count) {
      Damaged(fmt::format("a storage of {} numbers where {} are expected", count,
                          found->second.request.count));
    }
    const std::size_t bytes = BytesOf(found->second.request);
    if (bytes > file_.view.size() - at_) Damaged("ends too early");
    found->second.bytes = {file_.view.subspan(at_, bytes), file_.owner};
    at_ += bytes;
  }

  DataBytes Take(const TorchStorageRequest& request) const {
    const auto found = storages_.find(request.key);
    const bool placed = found != storages_.end() &&
                        (found->second.bytes.view.data() != nullptr || request.count == 0);
    if (!placed) Damaged("a tensor without its numbers");
    return found->second.bytes;
  }

  DataBytes file_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::map<std::string, PlacedStorage> storages_;
};

}  // namespace

bool LooksLikeTorchLegacy(std::span<const std::byte> head) { return EndOfMagic(head).has_value(); }

DataValue ReadTorchLegacy(DataBytes file, const std::string& where) {
  return LegacyReader(std::move(file), where).Read();
}

DataBytes ReadNestedTorchStorage(std::span<const std::byte> file, const std::string& where,
                                 ElementType& element) {
  LegacyReader reader({file, nullptr}, where);
  reader.Read();
  if (reader.Storages().size() != 1) {
    throw Error(where, "holds a pickled tensor that is not one storage", "Save it with torch.save");
  }
  const PlacedStorage& storage = reader.Storages().begin()->second;
  element = storage.request.element;
  return OwnBytes({storage.bytes.view.begin(), storage.bytes.view.end()});
}

}  // namespace holdfast
