// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "geometry/io/container/data_value.h"

namespace holdfast {

/// Bytes and their owner (a mapped file, a vector). Without an owner, the caller keeps them alive.
struct DataBytes {
  std::span<const std::byte> view;
  std::shared_ptr<const void> owner;
};

/// Takes ownership of a vector.
DataBytes OwnBytes(std::vector<std::byte> bytes);

/// Element type of an array: as in NpyArray, plus 'B' for bfloat16 and 'O' for Python objects.
struct ElementType {
  char kind = 'f';
  std::size_t size = 4;  ///< bytes
  bool big_endian = false;
};

using NodeIndex = std::uint32_t;

struct TextNode {
  std::string_view text;
};
struct BytesNode {
  std::string_view bytes;
  bool is_python2_text = false;  ///< Python 2's str: text or bytes, depending on content
};
struct ListNode {
  std::vector<NodeIndex> items;
};

struct DictNode {
  std::vector<std::pair<NodeIndex, NodeIndex>> entries;       ///< as in the file, until Finish()
  std::vector<std::pair<std::string_view, NodeIndex>> named;  ///< in file order, without duplicates
  std::vector<std::uint32_t> by_name;  ///< positions in `named`, sorted by name
};

/// Numbers or text in bytes that belong to the store. `strides` are in elements; empty means
/// contiguous, in C or Fortran order.
struct ArrayNode {
  ElementType element;
  std::vector<std::size_t> shape;
  bool fortran_order = false;
  std::vector<std::size_t> strides;
  std::span<const std::byte> bytes;               ///< from the first element on
  std::shared_ptr<std::vector<std::byte>> alone;  ///< holds `bytes` and nothing else, or null
};

/// An instance of an allowed class, or the class itself.
struct ObjectNode {
  std::string class_name;
  bool is_class = false;
  std::optional<NodeIndex> arguments;  ///< list: arguments of the class's call
  std::optional<NodeIndex> fields;     ///< dict
};

using DataNode = std::variant<std::monostate, bool, std::int64_t, double, TextNode, BytesNode,
                              ListNode, std::unique_ptr<DictNode>, std::unique_ptr<ArrayNode>,
                              std::unique_ptr<ObjectNode>>;

/// Stores the values of one file. Readers add nodes and then call Finish(); afterwards the store is
/// constant and may be read from any thread. Every buffer is charged to the store's budget before
/// it is allocated, so that no file can exceed the memory limit.
struct DataStore {
 public:
  /// `where` names the file in errors; `memory_limit` in bytes.
  DataStore(std::string where, std::size_t memory_limit);

  /// 10 x the size of the file + 64 MB.
  static std::size_t DefaultLimit(std::size_t file_bytes) {
    const std::size_t floor = std::size_t{64} << 20;
    return file_bytes > (SIZE_MAX - floor) / 10 ? SIZE_MAX : 10 * file_bytes + floor;
  }

  NodeIndex AddNone() { return 0; }
  NodeIndex AddBool(bool value) { return value ? 2 : 1; }
  NodeIndex AddInteger(std::int64_t value);
  NodeIndex AddReal(double value);
  /// Text that the store copies; it must be UTF-8.
  NodeIndex AddText(std::string text);
  /// Text in bytes that were passed to Keep().
  NodeIndex AddTextView(std::string_view text);
  NodeIndex AddBytes(std::string bytes, bool is_python2_text = false);
  NodeIndex AddBytesView(std::string_view bytes, bool is_python2_text = false);
  NodeIndex AddList(std::vector<NodeIndex> items = {});
  NodeIndex AddDict();
  NodeIndex AddArray(ArrayNode array);
  /// Takes ownership of the array's bytes.
  NodeIndex AddArray(NpyArray array);
  NodeIndex AddObject(ObjectNode object);

  /// Appends to a list and charges its growth.
  void Append(NodeIndex list, NodeIndex item);
  /// A later value of the same key replaces the earlier one, as in Python.
  void SetItem(NodeIndex dict, NodeIndex key, NodeIndex value);
  void SetItem(NodeIndex dict, std::string key, NodeIndex value);
  /// Keeps bytes alive that nodes point to.
  void Keep(std::shared_ptr<const void> owner);

  /// Charges `bytes` to the budget. Throws Error if that exceeds the limit.
  void Charge(std::size_t bytes);

  /// Prepares the names of dicts for look-up. Names are text keys of at most kMaxNameBytes, and
  /// integer keys as decimal text; other keys are kept aside.
  void Finish();

  DataNode& operator[](NodeIndex index) { return nodes_[index]; }
  const DataNode& operator[](NodeIndex index) const { return nodes_[index]; }
  std::size_t NumNodes() const { return nodes_.size(); }
  std::size_t MemoryLimit() const { return memory_limit_; }
  const std::string& Where() const { return where_; }

  static constexpr std::size_t kMaxNameBytes = 256;

 private:
  NodeIndex Add(DataNode node);
  std::optional<std::string_view> KeyName(NodeIndex key);
  std::string_view KeepName(NodeIndex key, std::string name);

  std::deque<DataNode> nodes_;
  std::deque<std::string> texts_;
  std::unordered_map<NodeIndex, std::string_view> decoded_names_;  ///< of keys that are not text
  std::vector<std::shared_ptr<const void>> owners_;
  std::string where_;
  std::size_t memory_limit_;
  std::size_t charged_ = 0;
};

/// Whether bytes are well-formed UTF-8.
bool IsUtf8(std::string_view bytes);

/// Numbers of a node (see DataValue::Array), converted and dense. Throws Error, named `where`.
NpyMember GatherNumbers(const DataStore& store, NodeIndex index, const std::string& where);

/// One array as stored, made contiguous if it has strides.
NpyMember GatherArray(const DataStore& store, const ArrayNode& array, const std::string& where);

/// Name of an element type: "float32", "bfloat16", "text".
std::string ElementTypeName(const ElementType& element);

/// Returns the instance (not the class) at an index, or null.
const ObjectNode* ObjectAt(const DataStore& store, NodeIndex index);

/// Returns the names of a dict or of an instance's state; null for anything else. Needs Finish().
const DictNode* NamesAt(const DataStore& store, NodeIndex index);

std::optional<NodeIndex> FindField(const DataStore& store, NodeIndex index, std::string_view name);

}  // namespace holdfast
