// SPDX-License-Identifier: MIT
#include "geometry/io/container/data_store.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Approximate allocator overhead per block.
constexpr std::size_t kBlock = 16;
// A node with its part of the unused space in a deque's blocks of 512 bytes.
constexpr std::size_t kNodeBytes = sizeof(DataNode) + 8;
// A key and its name in a map.
constexpr std::size_t kNameEntry = 64;
// An entry of a dict with its space in `entries` (which may double), `named` and `by_name`.
constexpr std::size_t kDictEntry = 4 * sizeof(std::pair<NodeIndex, NodeIndex>) +
                                   sizeof(std::pair<std::string_view, NodeIndex>) +
                                   sizeof(std::uint32_t);

}  // namespace

DataBytes OwnBytes(std::vector<std::byte> bytes) {
  auto owner = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  return {*owner, owner};
}

DataStore::DataStore(std::string where, std::size_t memory_limit)
    : where_(std::move(where)), memory_limit_(memory_limit) {
  nodes_.emplace_back(std::monostate());
  nodes_.emplace_back(false);
  nodes_.emplace_back(true);
}

void DataStore::Charge(std::size_t bytes) {
  if (bytes > memory_limit_ - charged_) {
    throw Error(where_,
                fmt::format("would take more than {} MB of memory, far more than its size",
                            memory_limit_ >> 20),
                "The file is damaged or hostile: get it from its source again");
  }
  charged_ += bytes;
}

NodeIndex DataStore::Add(DataNode node) {
  Charge(kNodeBytes);
  if (nodes_.size() >= std::numeric_limits<NodeIndex>::max()) {
    throw Error(where_, "holds more than 4 billion values", "Split the file");
  }
  nodes_.push_back(std::move(node));
  return static_cast<NodeIndex>(nodes_.size() - 1);
}

NodeIndex DataStore::AddInteger(std::int64_t value) { return Add(value); }
NodeIndex DataStore::AddReal(double value) { return Add(value); }
NodeIndex DataStore::AddTextView(std::string_view text) { return Add(TextNode{text}); }

NodeIndex DataStore::AddBytesView(std::string_view bytes, bool is_python2_text) {
  return Add(BytesNode{bytes, is_python2_text});
}

NodeIndex DataStore::AddText(std::string text) {
  Charge(sizeof(std::string) + text.capacity() + kBlock);
  return Add(TextNode{texts_.emplace_back(std::move(text))});
}

NodeIndex DataStore::AddBytes(std::string bytes, bool is_python2_text) {
  Charge(sizeof(std::string) + bytes.capacity() + kBlock);
  return Add(BytesNode{texts_.emplace_back(std::move(bytes)), is_python2_text});
}

NodeIndex DataStore::AddList(std::vector<NodeIndex> items) {
  if (!items.empty()) Charge(items.capacity() * sizeof(NodeIndex) + kBlock);
  return Add(ListNode{std::move(items)});
}

NodeIndex DataStore::AddDict() {
  Charge(sizeof(DictNode) + kBlock);
  return Add(std::make_unique<DictNode>());
}

NodeIndex DataStore::AddArray(ArrayNode array) {
  Charge(sizeof(ArrayNode) + kBlock + 16 * array.shape.size());
  return Add(std::make_unique<ArrayNode>(std::move(array)));
}

NodeIndex DataStore::AddArray(NpyArray array) {
  ArrayNode node;
  node.element = {array.kind, array.item_size, array.big_endian};
  node.shape = std::move(array.shape);
  node.fortran_order = array.fortran_order;
  node.alone = std::make_shared<std::vector<std::byte>>(std::move(array.data));
  node.bytes = *node.alone;
  return AddArray(std::move(node));
}

NodeIndex DataStore::AddObject(ObjectNode object) {
  Charge(sizeof(ObjectNode) + kBlock + object.class_name.size());
  return Add(std::make_unique<ObjectNode>(std::move(object)));
}

void DataStore::Append(NodeIndex list, NodeIndex item) {
  auto& items = std::get<ListNode>(nodes_[list]).items;
  if (items.size() == items.capacity()) {
    const std::size_t capacity = std::max<std::size_t>(4, 2 * items.capacity());
    Charge(capacity * sizeof(NodeIndex) + kBlock);
    items.reserve(capacity);
  }
  items.push_back(item);
}

void DataStore::SetItem(NodeIndex dict, NodeIndex key, NodeIndex value) {
  Charge(kDictEntry);
  std::get<std::unique_ptr<DictNode>>(nodes_[dict])->entries.emplace_back(key, value);
}

void DataStore::SetItem(NodeIndex dict, std::string key, NodeIndex value) {
  SetItem(dict, AddText(std::move(key)), value);
}

void DataStore::Keep(std::shared_ptr<const void> owner) {
  Charge(2 * sizeof(owner));
  owners_.push_back(std::move(owner));
}

std::string_view DataStore::KeepName(NodeIndex key, std::string name) {
  Charge(sizeof(std::string) + name.size() + kNameEntry);
  return decoded_names_[key] = texts_.emplace_back(std::move(name));
}

std::optional<std::string_view> DataStore::KeyName(NodeIndex key) {
  const DataNode& node = nodes_[key];
  std::string_view name;
  if (const auto* text = std::get_if<TextNode>(&node)) {
    name = text->text;
  } else if (const auto* bytes = std::get_if<BytesNode>(&node)) {
    name = bytes->bytes;
  } else if (const auto known = decoded_names_.find(key); known != decoded_names_.end()) {
    return known->second;
  } else if (const auto* integer = std::get_if<std::int64_t>(&node)) {
    return KeepName(key, std::to_string(*integer));
  } else if (const auto* array = std::get_if<std::unique_ptr<ArrayNode>>(&node)) {
    // A numpy text or integer scalar, as old code leaves behind.
    if (!(*array)->shape.empty() || (*array)->bytes.size() > 4 * kMaxNameBytes) return {};
    const NpyMember scalar = GatherArray(*this, **array, where_);
    const bool is_text = scalar.array.kind == 'U' || scalar.array.kind == 'S';
    if (!is_text && scalar.array.kind != 'i' && scalar.array.kind != 'u') return {};
    std::string decoded = is_text ? scalar.AsText() : std::to_string(scalar.AsIntegers().front());
    Charge(sizeof(std::string) + decoded.size() + kBlock);
    name = texts_.emplace_back(std::move(decoded));
  } else {
    return {};
  }
  if (name.size() > kMaxNameBytes) return {};
  return name;
}

void DataStore::Finish() {
  for (DataNode& node : nodes_) {
    const auto* held = std::get_if<std::unique_ptr<DictNode>>(&node);
    if (held == nullptr) continue;
    DictNode& dict = **held;
    dict.named.clear();
    dict.named.reserve(dict.entries.size());
    for (const auto& [key, value] : dict.entries) {
      if (const auto name = KeyName(key)) dict.named.emplace_back(*name, value);
    }
    // Of entries with the same name, the first gives the position and the last the value.
    std::vector<std::uint32_t> order(dict.named.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      const int sign = dict.named[a].first.compare(dict.named[b].first);
      return sign != 0 ? sign < 0 : a < b;
    });
    std::vector<bool> repeats(order.size(), false);
    for (std::size_t first = 0, i = 1; i < order.size(); ++i) {
      if (dict.named[order[i]].first == dict.named[order[first]].first) {
        dict.named[order[first]].second = dict.named[order[i]].second;
        repeats[order[i]] = true;
      } else {
        first = i;
      }
    }
    std::vector<std::uint32_t> place(order.size(), 0);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (repeats[i]) continue;
      place[i] = static_cast<std::uint32_t>(kept);
      dict.named[kept++] = dict.named[i];
    }
    dict.named.resize(kept);
    dict.by_name.clear();
    dict.by_name.reserve(kept);
    for (const std::uint32_t i : order) {
      if (!repeats[i]) dict.by_name.push_back(place[i]);
    }
  }
}

bool IsUtf8(std::string_view bytes) {
  for (std::size_t i = 0; i < bytes.size();) {
    const auto lead = static_cast<unsigned char>(bytes[i++]);
    if (lead < 0x80) continue;
    // Shortcut: half of the bytes that numpy writes into protocols 0 to 2 take two bytes here.
    if (lead >= 0xc2 && lead < 0xe0 && i < bytes.size() &&
        (static_cast<unsigned char>(bytes[i]) & 0xc0) == 0x80) {
      ++i;
      continue;
    }
    const int more = lead >= 0xc2 && lead < 0xe0   ? 1
                     : lead >= 0xe0 && lead < 0xf0 ? 2
                     : lead >= 0xf0 && lead < 0xf5 ? 3
                                                   : 0;
    if (more == 0) return false;
    for (int k = 0; k < more; ++k, ++i) {
      if (i >= bytes.size()) return false;
      const auto next = static_cast<unsigned char>(bytes[i]);
      // The first byte after the lead also rules out overlong forms. Surrogates are accepted, since
      // Python's pickles may hold them.
      const unsigned low = k > 0 ? 0x80u : lead == 0xe0 ? 0xa0u : lead == 0xf0 ? 0x90u : 0x80u;
      const unsigned high = k == 0 && lead == 0xf4 ? 0x8fu : 0xbfu;
      if (next < low || next > high) return false;
    }
  }
  return true;
}

DataValue ArrayValue(NpyArray array, std::string where) {
  auto store = std::make_shared<DataStore>(where, SIZE_MAX);
  const NodeIndex index = store->AddArray(std::move(array));
  return DataValue(std::move(store), index, std::move(where));
}

const ObjectNode* ObjectAt(const DataStore& store, NodeIndex index) {
  const auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&store[index]);
  return object == nullptr || (*object)->is_class ? nullptr : object->get();
}

const DictNode* NamesAt(const DataStore& store, NodeIndex index) {
  const ObjectNode* object = ObjectAt(store, index);
  if (object != nullptr && !object->fields) return nullptr;
  const auto* dict =
      std::get_if<std::unique_ptr<DictNode>>(&store[object != nullptr ? *object->fields : index]);
  return dict == nullptr ? nullptr : dict->get();
}

std::optional<NodeIndex> FindField(const DataStore& store, NodeIndex index, std::string_view name) {
  const DictNode* dict = NamesAt(store, index);
  if (dict == nullptr) return std::nullopt;
  const auto at = std::ranges::lower_bound(
      dict->by_name, name, {}, [&](std::uint32_t place) { return dict->named[place].first; });
  if (at == dict->by_name.end() || dict->named[*at].first != name) return std::nullopt;
  return dict->named[*at].second;
}

}  // namespace holdfast
