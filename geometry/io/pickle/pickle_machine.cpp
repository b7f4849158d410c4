// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_machine.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "geometry/io/pickle/pickle_text.h"

namespace holdfast {
namespace {

// Memo numbers up to this far beyond the memo's end extend it.
constexpr std::uint64_t kMemoGap = 64;
constexpr std::size_t kFarMemoEntry = 64;

// Makes room for one more value, which is charged first.
template <typename T>
void Grow(std::vector<T>& values, DataStore& store) {
  if (values.size() < values.capacity()) return;
  const std::size_t capacity = std::max<std::size_t>(64, 2 * values.capacity());
  store.Charge(capacity * sizeof(T));
  values.reserve(capacity);
}

}  // namespace

NodeIndex PickleMachine::Run() {
  while (true) {
    const unsigned char opcode = scanner_.Byte();
    if (opcode == '.') break;
    if (!RunNumber(opcode) && !RunMemoOrStack(opcode) && !RunContainer(opcode) &&
        !RunText(opcode) && !RunCall(opcode)) {
      FailOpcode(opcode);
    }
    if (store_.NumNodes() > options_.limits.max_values) {
      scanner_.FailDamaged(fmt::format("holds more than {} values", options_.limits.max_values));
    }
  }
  if (stack_.size() != 1 || !marks_.empty()) {
    scanner_.FailDamaged("does not end with one value");
  }
  return stack_.front();
}

void PickleMachine::FailOpcode(unsigned char opcode) const {
  if (opcode >= 0x82 && opcode <= 0x84) {
    scanner_.FailRefused("uses Python's extension registry, which is refused",
                         "Save it again without copyreg extensions");
  }
  scanner_.FailDamaged(fmt::format("has the unknown opcode 0x{:02x}", opcode));
}

void PickleMachine::Push(NodeIndex value) {
  Grow(stack_, store_);
  stack_.push_back(value);
}

void PickleMachine::PushMark() {
  Grow(marks_, store_);
  marks_.push_back(stack_.size());
}

NodeIndex& PickleMachine::Top() {
  if (stack_.size() <= (marks_.empty() ? 0 : marks_.back())) {
    scanner_.FailDamaged("takes a value where there is none");
  }
  return stack_.back();
}

NodeIndex PickleMachine::Pop() {
  const NodeIndex value = Top();
  stack_.pop_back();
  return value;
}

void PickleMachine::PopMany(NodeIndex* values, int count) {
  for (int i = count; i-- > 0;) values[i] = Pop();
}

std::vector<NodeIndex> PickleMachine::PopToMark() {
  if (marks_.empty()) scanner_.FailDamaged("goes back to a mark where there is none");
  const auto begin = stack_.begin() + static_cast<std::ptrdiff_t>(marks_.back());
  marks_.pop_back();
  std::vector<NodeIndex> values(begin, stack_.end());
  stack_.erase(begin, stack_.end());
  return values;
}

void PickleMachine::PushInteger(std::string_view decimal) {
  const auto value = ParseDecimal(decimal);
  if (!value) scanner_.FailDamaged("has an unreadable whole number");
  const auto* integer = std::get_if<std::int64_t>(&*value);
  Push(integer ? store_.AddInteger(*integer) : store_.AddReal(std::get<double>(*value)));
}

void PickleMachine::PushTwosComplement(std::string_view bytes) {
  const PickleInteger value = ParseTwosComplement(bytes);
  const auto* integer = std::get_if<std::int64_t>(&value);
  Push(integer ? store_.AddInteger(*integer) : store_.AddReal(std::get<double>(value)));
}

void PickleMachine::PushUnicode(std::string_view utf8) {
  if (!IsUtf8(utf8)) scanner_.FailDamaged("has a text that is not UTF-8");
  Push(store_.AddTextView(utf8));
}

void PickleMachine::PushTuple(int count) {
  std::vector<NodeIndex> items(static_cast<std::size_t>(count));
  PopMany(items.data(), count);
  Push(store_.AddList(std::move(items)));
}

void PickleMachine::SetItems(const std::vector<NodeIndex>& keys_and_values) {
  if (keys_and_values.size() % 2 != 0) scanner_.FailDamaged("has a key without a value");
  const NodeIndex container = Top();
  for (std::size_t i = 0; i < keys_and_values.size(); i += 2) {
    calls_.SetItem(container, keys_and_values[i], keys_and_values[i + 1]);
  }
}

void PickleMachine::Memoize(std::uint64_t place) {
  const NodeIndex value = Top();
  bool is_new = false;
  if (place < memo_.size() + kMemoGap) {
    while (memo_.size() <= place) {
      Grow(memo_, store_);
      memo_.push_back(kNoValue);
    }
    is_new = memo_[place] == kNoValue;
    memo_[place] = value;
  } else {
    store_.Charge(kFarMemoEntry);
    is_new = far_memo_.insert_or_assign(place, value).second;
  }
  if (is_new) ++memo_size_;
}

void PickleMachine::PushMemo(std::uint64_t place) {
  if (place < memo_.size() && memo_[place] != kNoValue) return Push(memo_[place]);
  const auto far = far_memo_.find(place);
  if (far == far_memo_.end()) {
    scanner_.FailDamaged(fmt::format("asks for value {} of its memo, which is not there", place));
  }
  Push(far->second);
}

std::uint64_t PickleMachine::DecimalPlace() {
  const auto place = ParseDecimal(scanner_.Line());
  const auto* integer = place ? std::get_if<std::int64_t>(&*place) : nullptr;
  if (integer == nullptr || *integer < 0) scanner_.FailDamaged("has an unreadable memo number");
  return static_cast<std::uint64_t>(*integer);
}

void PickleMachine::PushNextBuffer() {
  if (next_buffer_ == options_.buffers.size()) {
    scanner_.FailRefused("needs buffers that lie outside of the file (protocol 5)",
                         "Save it without buffer_callback");
  }
  const DataBytes& buffer = options_.buffers[next_buffer_++];
  store_.Keep(buffer.owner);
  Push(
      store_.AddBytesView({reinterpret_cast<const char*>(buffer.view.data()), buffer.view.size()}));
}

std::string_view PickleMachine::TextOf(NodeIndex name) const {
  const auto* text = std::get_if<TextNode>(&store_[name]);
  if (text == nullptr) scanner_.FailDamaged("names a class by what is not text");
  return text->text;
}

}  // namespace holdfast
