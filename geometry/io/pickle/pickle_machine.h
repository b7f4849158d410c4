// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "geometry/io/pickle/pickle_arrays.h"
#include "geometry/io/pickle/pickle_globals.h"
#include "geometry/io/pickle/pickle_text.h"

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
  PickleNumpy& Numpy() { return numpy_; }

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

/// The stack machine that runs a pickle: one opcode after the other until STOP, with a stack of
/// values, marks in it, and a memo of values by number. The opcodes are those that Python's
/// pickletools describes.
class PickleMachine {
 public:
  PickleMachine(PickleScanner& scanner, PickleContext& context)
      : scanner_(scanner), store_(context.store), calls_(context) {}

  /// Runs to STOP and returns the remaining value.
  NodeIndex Run();
  /// To be called after Run(): requests what is stored outside the pickle.
  void Finish() { calls_.Finish(); }
  /// Whether a value is an array of one object without dimensions; it is a list of one.
  bool IsObjectScalar(NodeIndex value) const { return calls_.IsObjectScalar(value); }

 private:
  // Each returns whether the opcode is of its group, and runs it if so; the groups are disjoint.
  bool RunNumber(unsigned char opcode);
  bool RunText(unsigned char opcode);
  bool RunContainer(unsigned char opcode);
  bool RunMemoOrStack(unsigned char opcode);
  bool RunCall(unsigned char opcode);
  [[noreturn]] void FailOpcode(unsigned char opcode) const;

  void Push(NodeIndex value);
  void PushMark();
  NodeIndex Pop();
  NodeIndex& Top();
  void PopMany(NodeIndex* values, int count);  ///< in the order they were pushed
  /// Removes the last mark and returns the values above it.
  std::vector<NodeIndex> PopToMark();

  void PushInteger(std::string_view decimal);
  void PushWhole(const PickleInteger& value);
  void PushUnicode(std::string_view utf8);
  void PushTuple(int count);
  void SetItems(const std::vector<NodeIndex>& keys_and_values);
  void Memoize(std::uint64_t place);
  void PushMemo(std::uint64_t place);
  std::uint64_t DecimalPlace();
  std::string_view TextOf(NodeIndex name) const;

  PickleScanner& scanner_;
  DataStore& store_;
  PickleCalls calls_;
  std::vector<NodeIndex> stack_;
  std::vector<std::size_t> marks_;                         ///< heights of the stack
  std::vector<NodeIndex> memo_;                            ///< by number, for consecutive numbers
  std::unordered_map<std::uint64_t, NodeIndex> far_memo_;  ///< for the others
  std::size_t memo_size_ = 0;
  std::vector<NodeIndex> small_integers_;
};

}  // namespace holdfast
