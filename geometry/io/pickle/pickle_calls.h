// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/pickle/pickle_arrays.h"
#include "geometry/io/pickle/pickle_globals.h"

namespace holdfast {

/// Turns the calls that a pickle requests into the data that they describe.
class PickleCalls {
 public:
  explicit PickleCalls(PickleContext& context)
      : context_(context), numpy_(context), torch_(context) {}

  /// Returns the node of a name. Throws Error with the name unless it is in the table.
  NodeIndex Global(std::string_view module, std::string_view name);
  NodeIndex Call(NodeIndex callee, NodeIndex arguments);
  /// Sets the state of a call's result: fields of an instance, contents of an array.
  void SetState(NodeIndex object, NodeIndex state);
  void SetItem(NodeIndex container, NodeIndex key, NodeIndex value);
  void Append(NodeIndex container, NodeIndex item);
  NodeIndex PersistentId(NodeIndex id) { return torch_.Storage(id); }
  /// To be called after the pickle's end.
  void Finish() { torch_.Bind(); }
  bool IsObjectScalar(NodeIndex value) const { return numpy_.IsObjectScalar(value); }

 private:
  using Arguments = std::vector<NodeIndex>;

  NodeIndex Instance(NodeIndex type, std::optional<NodeIndex> arguments);
  NodeIndex ListOf(const Arguments& arguments);
  NodeIndex DictOf(const Arguments& arguments);
  NodeIndex BytesOf(const Arguments& arguments);
  NodeIndex Latin1(const Arguments& arguments);
  NodeIndex Path(const Arguments& arguments);
  NodeIndex Reconstruct(const Arguments& arguments);
  /// Resolves calls that only state which call is meant, in place; true if there was one.
  bool Redirect(const AllowedGlobal*& global, NodeIndex& callee, NodeIndex& arguments);

  PickleContext& context_;
  PickleNumpy numpy_;
  PickleTorch torch_;
  std::map<std::string, NodeIndex, std::less<>> names_;
};

}  // namespace holdfast
