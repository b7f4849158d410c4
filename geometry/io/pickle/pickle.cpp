// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/pickle/pickle_globals.h"
#include "geometry/io/pickle/pickle_machine.h"
#include "geometry/io/pickle/pickle_text.h"

namespace holdfast {
namespace {

// Steps from the root to the deepest value, along the shortest path if there are several.
constexpr std::size_t kMaxPickleDepth = 1000;

// Calls `visit` for each value that a node holds.
template <typename Visit>
void ForEachChild(const DataNode& node, Visit&& visit) {
  if (const auto* list = std::get_if<ListNode>(&node)) {
    for (const NodeIndex item : list->items) visit(item);
  } else if (const auto* dict = std::get_if<std::unique_ptr<DictNode>>(&node)) {
    for (const auto& [key, value] : (*dict)->entries) visit(value);
  } else if (const auto* object = std::get_if<std::unique_ptr<ObjectNode>>(&node)) {
    if ((*object)->arguments) visit(*(*object)->arguments);
    if ((*object)->fields) visit(*(*object)->fields);
  }
}

// Level by level from the root; each value counts at its smallest depth, so that cycles end.
void CheckDepth(DataStore& store, NodeIndex root) {
  store.Charge(store.NumNodes() * (1 + 2 * sizeof(NodeIndex)));
  std::vector<bool> seen(store.NumNodes(), false);
  std::vector<NodeIndex> level{root}, next;
  seen[root] = true;
  for (std::size_t depth = 0; !level.empty(); ++depth) {
    if (depth > kMaxPickleDepth) {
      throw Error(store.Where(), fmt::format("is nested more than {} values deep", kMaxPickleDepth),
                  "The file is damaged or hostile: get it from its source again");
    }
    next.clear();
    for (const NodeIndex index : level) {
      ForEachChild(std::as_const(store)[index], [&](NodeIndex child) {
        if (seen[child]) return;
        seen[child] = true;
        next.push_back(child);
      });
    }
    std::swap(level, next);
  }
}

// `is_object_array`: an array of objects without dimensions stands for its only item.
DataValue Read(DataBytes bytes, std::string where, const PickleOptions& options,
               std::size_t* bytes_read, bool is_object_array) {
  const std::size_t limit =
      options.max_memory != 0 ? options.max_memory : DataStore::DefaultLimit(bytes.view.size());
  auto store = std::make_shared<DataStore>(where, limit);
  if (!bytes.owner) {
    store->Charge(bytes.view.size());
    bytes = OwnBytes({bytes.view.begin(), bytes.view.end()});
  }
  store->Keep(bytes.owner);
  PickleScanner scanner(bytes.view, where);
  PickleContext context{*store, scanner, options};
  PickleMachine machine(scanner, context);
  NodeIndex root = machine.Run();
  if (bytes_read != nullptr) *bytes_read = scanner.Position();
  machine.Finish();
  CheckDepth(*store, root);
  store->Finish();
  if (is_object_array && machine.IsObjectScalar(root)) {
    root = std::get<ListNode>((*store)[root]).items.front();
  }
  return DataValue(std::move(store), root, std::move(where));
}

}  // namespace

DataValue ReadPickle(DataBytes bytes, std::string where, const PickleOptions& options,
                     std::size_t* bytes_read) {
  return Read(std::move(bytes), std::move(where), options, bytes_read, false);
}

DataValue ReadObjectArray(DataBytes pickle, std::string where, const PickleOptions& options) {
  return Read(std::move(pickle), std::move(where), options, nullptr, true);
}

bool LooksLikePickle(std::span<const std::byte> head) {
  if (head.empty()) return false;
  const auto first = static_cast<unsigned char>(head[0]);
  if (first == 0x80) return head.size() > 1 && static_cast<unsigned char>(head[1]) <= 5;
  // Protocols 0 and 1 begin with a container or a name: "(dp0", "(lp0", "}q", "]q", "cnumpy.core".
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  return text.starts_with("(d") || text.starts_with("(l") || text.starts_with("(i") ||
         text.starts_with("}q") || text.starts_with("]q") || text.starts_with("}.") ||
         text.starts_with("].") || text.starts_with("ccollections\n") ||
         text.starts_with("ccopy_reg\n") || text.starts_with("cnumpy");
}

}  // namespace holdfast
