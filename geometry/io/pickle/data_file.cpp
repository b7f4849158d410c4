// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/data_file.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/container/zip_archive.h"
#include "geometry/io/pickle/pickle.h"
#include "geometry/io/pickle/torch_archive.h"

namespace holdfast {
namespace {

constexpr std::size_t kHeadBytes = 512;
constexpr std::size_t kTarMarkOffset = 257;
constexpr std::size_t kNamesInMessage = 12;

std::span<const std::byte> AsBytes(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

// Rejects files that users give by mistake, with a remedy.
void RefuseKnownOthers(std::string_view head, const std::string& name) {
  constexpr std::string_view kFetch = "Fetch the file itself";
  constexpr std::string_view kOthers[][3] = {
      {"\x89HDF", "is HDF5", "Save its arrays as .npz"},
      {"MATLAB 5.0", "is a MATLAB file", "Save its arrays as .npz (scipy.io.loadmat)"},
      {"version https://git-lfs", "is a pointer of git-lfs, not the data", "Run 'git lfs pull'"},
      {"<!DOCTYPE", "is a web page, such as the login page of a download site", kFetch},
      {"<!doctype", "is a web page, such as the login page of a download site", kFetch},
      {"<html", "is a web page, such as the login page of a download site", kFetch},
      {"Rar!", "is a rar archive", "Unpack it first"},
      {"7z\xbc\xaf", "is a 7z archive", "Unpack it first"},
      {"BZh", "is packed by bzip2", "Unpack it first (bunzip2)"},
      {"\xfd"
       "7zXZ",
       "is packed by xz", "Unpack it first (unxz)"},
  };
  for (const auto& [begin, problem, remedy] : kOthers) {
    if (head.starts_with(begin)) throw Error(name, problem, remedy);
  }
  if (head.size() > kTarMarkOffset && head.substr(kTarMarkOffset).starts_with("ustar")) {
    throw Error(name, "is a tar archive, or a file of torch before 0.4, which used that format",
                "Unpack it; a torch file: load it in torch and save it again");
  }
}

// joblib.dump(compress=...) packs whole pickles with zlib.
bool BeginsAsZlib(std::string_view head) {
  if (head.size() < 2 || head[0] != 'x') return false;
  return ('x' * 256 + static_cast<unsigned char>(head[1])) % 31 == 0;
}

bool BeginsAsJson(std::string_view head) {
  if (head.starts_with("\xef\xbb\xbf")) head.remove_prefix(3);
  const auto at = head.find_first_not_of(" \t\r\n");
  return at != std::string_view::npos && (head[at] == '{' || head[at] == '[');
}

// Detects whether a zip archive is of numpy or of torch. Throws Error if it is neither.
DataFormat ZipFormat(const ZipArchive& archive) {
  const auto is_array = [](const ZipMember& member) { return member.name.ends_with(".npy"); };
  const auto& members = archive.Members();
  if (IsTorchArchive(archive)) return DataFormat::kTorchZip;
  if (std::any_of(members.begin(), members.end(), is_array)) return DataFormat::kNpz;
  // Arrays may lack their suffix; numpy.savez() without arrays writes an empty archive.
  if (members.empty()) return DataFormat::kNpz;
  constexpr std::size_t kLooks = 16;
  for (std::size_t i = 0; i < std::min(members.size(), kLooks); ++i) {
    const ZipMember& member = members[i];
    if (member.size < kNpyMagic.size() || member.name.ends_with('/')) continue;
    try {
      std::string magic(kNpyMagic.size(), '\0');
      ZipArchive::Stream(archive, member, archive.Source().Name())
          .Read(std::as_writable_bytes(std::span(magic)));
      if (magic == kNpyMagic) return DataFormat::kNpz;
    } catch (const Error&) {
      continue;  // another member may decide
    }
  }
  std::vector<std::string> names;
  for (const ZipMember& member : members) {
    if (names.size() <= kNamesInMessage) names.emplace_back(member.name);
  }
  throw Error(archive.Source().Name(), "is a zip archive of neither numpy nor torch",
              fmt::format("Unpack it first. It has: {}", SomeNames(names, kNamesInMessage)));
}

// Copies all values of `from` to `to`, which keeps them alive; returns the new index of `index`.
NodeIndex Adopt(DataStore& to, const std::shared_ptr<const DataStore>& from, NodeIndex index) {
  constexpr std::size_t kConstants = 3;  // None, False and True come first in every store
  const std::size_t base = to.NumNodes();
  const auto moved = [&](NodeIndex i) {
    return i < kConstants ? i : static_cast<NodeIndex>(i - kConstants + base);
  };
  const auto add = [&](NodeIndex i) {
    const DataNode& node = (*from)[i];
    if (const auto* integer = std::get_if<std::int64_t>(&node)) return to.AddInteger(*integer);
    if (const auto* real = std::get_if<double>(&node)) return to.AddReal(*real);
    if (const auto* text = std::get_if<TextNode>(&node)) return to.AddTextView(text->text);
    if (const auto* bytes = std::get_if<BytesNode>(&node)) {
      return to.AddBytesView(bytes->bytes, bytes->is_python2_text);
    }
    if (const auto* list = std::get_if<ListNode>(&node)) {
      std::vector<NodeIndex> items(list->items);
      for (NodeIndex& item : items) item = moved(item);
      return to.AddList(std::move(items));
    }
    if (const auto* dict = std::get_if<std::unique_ptr<DictNode>>(&node)) {
      const NodeIndex copy = to.AddDict();
      for (const auto& [key, value] : (*dict)->entries) to.SetItem(copy, moved(key), moved(value));
      return copy;
    }
    if (const auto* array = std::get_if<std::unique_ptr<ArrayNode>>(&node)) {
      return to.AddArray(**array);
    }
    const auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&node);
    if (object == nullptr) return to.AddList();  // never: the other kinds come first
    ObjectNode copy = **object;
    if (copy.arguments) copy.arguments = moved(*copy.arguments);
    if (copy.fields) copy.fields = moved(*copy.fields);
    return to.AddObject(std::move(copy));
  };
  for (std::size_t i = kConstants; i < from->NumNodes(); ++i) add(static_cast<NodeIndex>(i));
  to.Keep(from);
  return moved(index);
}

}  // namespace

std::string_view DataFormatName(DataFormat format) {
  switch (format) {
    case DataFormat::kNpz:
      return "npz";
    case DataFormat::kNpy:
      return "npy";
    case DataFormat::kPickle:
      return "pickle";
    case DataFormat::kTorchZip:
      return "torch";
    case DataFormat::kTorchLegacy:
      return "torch (before 1.6)";
    case DataFormat::kJson:
      return "JSON";
    case DataFormat::kSafetensors:
      return "safetensors";
  }
  return "unknown";
}

struct DataFile::Content {
  struct NpyFile {
    ByteSource source;
    NpyArray array;  // without data
    std::uint64_t data_offset = 0;
  };

  std::filesystem::path path;
  DataFormat format = DataFormat::kPickle;
  std::uint64_t file_bytes = 0;
  DataBytes unpacked;  // content of a gzipped file, used by the readers
  // One of these four. Arrays are read on demand; anything else is one value.
  std::optional<NpzReader> npz;
  std::optional<SafetensorsReader> tensors;
  std::optional<NpyFile> npy;
  std::optional<DataValue> root;

  void Open(ByteSource source) {
    path = source.Name();
    file_bytes = source.Size();
    std::string head = source.Head(kHeadBytes);
    if (head.starts_with("\x1f\x8b") || BeginsAsZlib(head)) {
      unpacked = OwnBytes(ReadGzip(source, GzipLimit()));
      source = ByteSource(unpacked.view, path.string());
      head = source.Head(kHeadBytes);
    }
    RefuseKnownOthers(head, path.string());
    if (head.starts_with("PK\x03\x04") || head.starts_with("PK\x05\x06")) {
      OpenZip(std::move(source));
    } else if (head.starts_with(kNpyMagic)) {
      format = DataFormat::kNpy;
      OpenNpy(std::move(source));
    } else if (LooksLikeTorchLegacy(AsBytes(head))) {
      format = DataFormat::kTorchLegacy;
      root = ReadTorchLegacy(Whole(source), path.string());
    } else if (SafetensorsReader::Recognizes(head, source.Size())) {
      format = DataFormat::kSafetensors;
      tensors.emplace(std::move(source));
    } else if (BeginsAsJson(head)) {
      format = DataFormat::kJson;
      const DataBytes text = Whole(source);
      root = ReadJsonData({reinterpret_cast<const char*>(text.view.data()), text.view.size()},
                          path.string(), MemoryLimit() - (unpacked.owner ? 0 : text.view.size()));
    } else if (LooksLikePickle(AsBytes(head))) {
      format = DataFormat::kPickle;
      root = ReadPickle(Whole(source), path.string(), Options(0));
    } else {
      throw Error(path.string(), "is not of a supported format",
                  "Give .npz, .npy, a pickle, a torch file, safetensors or JSON; motion also as "
                  ".bvh, .amc, .glb or .gltf");
    }
  }

  void OpenZip(ByteSource source) {
    auto archive = std::make_unique<const ZipArchive>(std::move(source));
    format = ZipFormat(*archive);
    if (format == DataFormat::kTorchZip) {
      root = ReadTorchArchive(*archive);
    } else {
      npz.emplace(std::move(archive));
    }
  }

  void OpenNpy(ByteSource source) {
    std::uint64_t at = 0;
    NpyArray array = ReadNpyStart(
        [&](std::span<std::byte> target) {
          source.ReadAt(at, target);
          at += target.size();
        },
        path.string(), true);
    if (array.kind == 'O') {
      std::vector<std::byte> pickle(static_cast<std::size_t>(source.Size() - at));
      source.ReadAt(at, pickle);
      root = ReadObjectArray(OwnBytes(std::move(pickle)), path.string(), Options(0));
      return;
    }
    NpyDataBytes(array, source.Size() - at, path.string());
    npy = NpyFile{std::move(source), std::move(array), at};
  }

  DataValue ReadNpy() const {
    NpyArray array = npy->array;
    array.data.resize(NpyDataBytes(array, npy->source.Size() - npy->data_offset, path.string()));
    npy->source.ReadAt(npy->data_offset, array.data);
    return ArrayValue(std::move(array), path.string());
  }

  // All bytes of the file, which must hold one value.
  DataBytes Whole(const ByteSource& source) const {
    if (unpacked.owner) return unpacked;
    std::vector<std::byte> bytes(static_cast<std::size_t>(source.Size()));
    source.ReadAt(0, bytes);
    return OwnBytes(std::move(bytes));
  }

  // Text and pickled numbers compress two to five times; a few kilobytes of zeros are rejected.
  std::size_t GzipLimit() const {
    return (std::size_t{32} << 20) + 8 * static_cast<std::size_t>(file_bytes);
  }

  // Memory that the values of the file may take in addition to its bytes.
  std::size_t MemoryLimit() const {
    return DataStore::DefaultLimit(static_cast<std::size_t>(file_bytes)) - unpacked.view.size();
  }

  // A pickle may be well compressed within its file.
  PickleOptions Options(std::size_t packed_pickle_bytes) const {
    PickleOptions options;
    options.max_memory = MemoryLimit() + 2 * packed_pickle_bytes;
    options.nested_torch_file = [where = path.string()](std::span<const std::byte> file,
                                                        ElementType& element) {
      return ReadNestedTorchStorage(file, where, element);
    };
    return options;
  }

  std::vector<std::string> Names() const {
    if (npz) return npz->Keys();
    if (tensors) return tensors->Names();
    return root ? root->Names() : std::vector<std::string>();
  }

  bool Has(std::string_view name) const {
    if (npz) return npz->Has(name);
    if (tensors) return tensors->Has(name);
    return root && root->Has(name);
  }

  DataValue Member(std::string_view name) const {
    if (root) return (*root)[name];
    if (npy) {
      throw Error(fmt::format("{}[{}]", path.string(), name), "is missing",
                  "The file holds one array, without a name");
    }
    if (std::optional<NpyMember> plain = PlainMember(name)) {
      return ArrayValue(std::move(plain->array), std::move(plain->where));
    }
    std::vector<std::byte> pickle = npz->ReadPickle(name, std::numeric_limits<std::size_t>::max());
    const PickleOptions options = Options(pickle.size());
    return ReadObjectArray(OwnBytes(std::move(pickle)), npz->ReadHeader(name).where, options);
  }

  // Reads a member that is an array of numbers or text; nullopt if it holds Python objects.
  std::optional<NpyMember> PlainMember(std::string_view name) const {
    if (tensors) return tensors->Read(name);
    if (npz->ReadHeader(name).array.kind == 'O') return std::nullopt;
    return npz->Read(name);
  }

  DataValue Root() const {
    if (root) return *root;
    if (npy) return ReadNpy();
    auto store = std::make_shared<DataStore>(path.string(), SIZE_MAX);
    const NodeIndex all = store->AddDict();
    for (const std::string& name : Names()) {
      if (std::optional<NpyMember> plain = PlainMember(name)) {
        store->SetItem(all, name, store->AddArray(std::move(plain->array)));
        continue;
      }
      const DataValue value = Member(name);
      store->SetItem(all, name, Adopt(*store, value.Store(), value.Index()));
    }
    store->Finish();
    return DataValue(std::move(store), all, path.string());
  }
};

DataFile::DataFile(const std::filesystem::path& path) : content_(std::make_unique<Content>()) {
  content_->Open(ByteSource(path));
}

DataFile::DataFile(std::span<const std::byte> bytes, std::string name)
    : content_(std::make_unique<Content>()) {
  content_->Open(ByteSource(bytes, std::move(name)));
}

DataFile::~DataFile() = default;
DataFile::DataFile(DataFile&&) noexcept = default;
DataFile& DataFile::operator=(DataFile&&) noexcept = default;

DataFormat DataFile::Format() const { return content_->format; }
const std::filesystem::path& DataFile::Path() const { return content_->path; }
bool DataFile::Has(std::string_view name) const { return content_->Has(name); }
std::vector<std::string> DataFile::Names() const { return content_->Names(); }
DataValue DataFile::operator[](std::string_view name) const { return content_->Member(name); }
DataValue DataFile::Root() const { return content_->Root(); }

std::optional<DataValue> DataFile::Find(std::string_view name) const {
  if (!Has(name)) return std::nullopt;
  return content_->Member(name);
}

std::map<std::string, std::string> DataFile::Metadata() const {
  return content_->tensors ? content_->tensors->Metadata() : std::map<std::string, std::string>();
}

namespace {

constexpr std::size_t kMaxDepth = 100;

// Builds the values during parsing, which does not recurse.
class Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(DataStore& store, std::string_view text) : store_(store), text_(text) {}

  /// Sets where the text that is parsed next begins in the whole text.
  void BeginAt(std::size_t offset) { offset_ = offset; }

  NodeIndex Root() const { return root_; }

  bool null() override { return Put(store_.AddNone()); }
  bool boolean(bool value) override { return Put(store_.AddBool(value)); }
  bool number_integer(number_integer_t value) override { return Put(store_.AddInteger(value)); }
  bool number_unsigned(number_unsigned_t value) override {
    const bool fits = value <= std::uint64_t{std::numeric_limits<std::int64_t>::max()};
    return Put(fits ? store_.AddInteger(static_cast<std::int64_t>(value))
                    : store_.AddReal(static_cast<double>(value)));
  }
  bool number_float(number_float_t value, const string_t&) override {
    return Put(store_.AddReal(value));
  }
  bool string(string_t& text) override { return Put(store_.AddText(std::move(text))); }
  bool binary(binary_t&) override { return false; }  // for formats other than JSON
  bool start_object(std::size_t) override { return Open(store_.AddDict()); }
  bool end_object() override { return Close(); }
  bool start_array(std::size_t) override { return Open(store_.AddList()); }
  bool end_array() override { return Close(); }
  bool key(string_t& name) override {
    key_ = store_.AddText(std::move(name));
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception&) override {
    const std::size_t at = std::min(offset_ + (position == 0 ? 0 : position - 1), text_.size());
    std::size_t line = 1, column = 1;
    for (std::size_t i = 0; i < at; ++i) {
      column = text_[i] == '\n' ? 1 : column + 1;
      line += text_[i] == '\n';
    }
    throw Error(store_.Where(),
                at >= text_.size() ? "ends within its JSON"
                                   : fmt::format("is not JSON at line {}, column {}", line, column),
                "Save it again; NaN and Infinity are not JSON");
  }

 private:
  bool Put(NodeIndex value) {
    if (open_.empty()) {
      root_ = value;
    } else if (std::holds_alternative<ListNode>(store_[open_.back()])) {
      store_.Append(open_.back(), value);
    } else {
      store_.SetItem(open_.back(), key_, value);
    }
    return true;
  }
  bool Open(NodeIndex container) {
    if (open_.size() == kMaxDepth) {
      throw Error(store_.Where(), fmt::format("is nested more than {} levels deep", kMaxDepth),
                  "Reduce its nesting");
    }
    Put(container);
    open_.push_back(container);
    return true;
  }
  bool Close() {
    open_.pop_back();
    return true;
  }

  DataStore& store_;
  std::string_view text_;
  std::size_t offset_ = 0;
  std::vector<NodeIndex> open_;  // containers
  NodeIndex key_ = 0;
  NodeIndex root_ = 0;
};

// Returns the line that begins at `at`, and moves `at` behind it.
std::string_view NextLine(std::string_view text, std::size_t& at) {
  const std::size_t end = std::min(text.find('\n', at), text.size());
  const std::string_view line = text.substr(at, end - at);
  at = end + 1;
  return line;
}

bool IsBlank(std::string_view text) {
  return text.find_first_not_of(" \t\r\n") == std::string_view::npos;
}

}  // namespace

bool IsJsonLines(std::string_view text) {
  std::size_t at = 0;
  const std::string_view first = NextLine(text, at);
  return at < text.size() && !IsBlank(text.substr(at)) && nlohmann::json::accept(first);
}

DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit) {
  auto store = std::make_shared<DataStore>(where, memory_limit);
  Builder builder(*store, text);
  if (IsJsonLines(text)) {
    builder.start_array(0);
    for (std::size_t at = 0; at < text.size();) {
      builder.BeginAt(at);
      const std::string_view line = NextLine(text, at);
      if (!IsBlank(line)) nlohmann::json::sax_parse(line, &builder);
    }
    builder.end_array();
  } else {
    nlohmann::json::sax_parse(text, &builder);
  }
  store->Finish();
  return DataValue(std::move(store), builder.Root(), where);
}

}  // namespace holdfast
