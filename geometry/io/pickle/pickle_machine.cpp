// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_machine.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/io/container/text_scanner.h"
#include "geometry/io/pickle/pickle_text.h"

namespace holdfast {
namespace {

constexpr std::size_t kShownName = 80;

}  // namespace

NodeIndex PickleCalls::Global(std::string_view module, std::string_view name) {
  const AllowedGlobal* row = FindAllowedGlobal(module, name);
  if (row == nullptr) {
    context_.scanner.FailRefused(
        fmt::format("asks for '{}.{}', which is refused: nothing in a file is executed",
                    Excerpt(module, kShownName), Excerpt(name, kShownName)),
        "If you trust the file, load it in Python and save what is needed as arrays (numpy.savez)");
  }
  std::string full = fmt::format("{}.{}", module, name);
  if (const auto known = names_.find(full); known != names_.end()) return known->second;
  context_.store.Charge(256 + full.size());
  const NodeIndex node = context_.store.AddObject({full, true, {}, {}});
  context_.globals.emplace(node, row);
  names_.emplace(std::move(full), node);
  return node;
}

NodeIndex PickleCalls::Instance(NodeIndex type, std::optional<NodeIndex> arguments) {
  return context_.store.AddObject(
      {context_.ObjectAt(type)->class_name, false, arguments, std::nullopt});
}

NodeIndex PickleCalls::ListOf(const Arguments& arguments) {
  if (arguments.empty()) return context_.store.AddList();
  const std::vector<NodeIndex>* items = context_.ItemsAt(arguments[0]);
  if (items == nullptr)
    context_.scanner.FailDamaged("makes a list from a value that is not a list");
  return context_.store.AddList(*items);
}

NodeIndex PickleCalls::DictOf(const Arguments& arguments) {
  const NodeIndex dict = context_.store.AddDict();
  for (const NodeIndex argument : arguments) {
    if (const DictNode* other = context_.DictAt(argument)) {
      for (std::size_t i = 0; i < other->entries.size(); ++i) {
        const auto [key, value] = other->entries[i];
        context_.store.SetItem(dict, key, value);
      }
    } else if (const std::vector<NodeIndex>* pairs = context_.ItemsAt(argument)) {
      for (const NodeIndex pair : *pairs) {
        const std::vector<NodeIndex>* both = context_.ItemsAt(pair);
        if (both == nullptr || both->size() != 2) {
          context_.scanner.FailDamaged("makes a dict from items that are not pairs");
        }
        context_.store.SetItem(dict, (*both)[0], (*both)[1]);
      }
    } else if (!context_.IsNone(argument) && context_.GlobalAt(argument) == nullptr) {
      context_.scanner.FailDamaged("makes a dict from a value that is not a dict");
    }
  }
  return dict;
}

NodeIndex PickleCalls::BytesOf(const Arguments& arguments) {
  if (arguments.empty()) return context_.store.AddBytesView({});
  if (arguments.size() >= 2) return Latin1(arguments);
  const auto* bytes = std::get_if<BytesNode>(&context_.store[arguments[0]]);
  if (bytes == nullptr) context_.scanner.FailDamaged("makes bytes from a value that is not bytes");
  return context_.store.AddBytesView(bytes->bytes);
}

NodeIndex PickleCalls::Latin1(const Arguments& arguments) {
  const auto text = arguments.empty() ? std::nullopt : context_.TextAt(arguments[0]);
  const auto encoding = arguments.size() != 2 ? std::nullopt : context_.TextAt(arguments[1]);
  if (!text || !encoding) context_.scanner.FailDamaged("encodes a value that is not text");
  if (*encoding != "latin1" && *encoding != "latin-1") {
    context_.scanner.FailRefused(
        fmt::format("holds bytes encoded as '{}'", Excerpt(*encoding, kShownName)),
        "Save it again with Python's own pickle");
  }
  context_.store.Charge(text->size());  // temporaries cost time, too
  auto bytes = EncodeLatin1(*text);
  if (!bytes) context_.scanner.FailDamaged("encodes text that does not fit into bytes");
  return context_.store.AddBytes(*std::move(bytes));
}

NodeIndex PickleCalls::Path(const Arguments& arguments) {
  std::string path;
  for (const NodeIndex argument : arguments) {
    const auto part = context_.TextAt(argument);
    if (!part) context_.scanner.FailDamaged("makes a path from values that are not text");
    context_.store.Charge(part->size() + 1);
    if (!path.empty() && path.back() != '/') path.push_back('/');
    path.append(*part);
  }
  return context_.store.AddText(std::move(path));
}

NodeIndex PickleCalls::Reconstruct(const Arguments& arguments) {
  const AllowedGlobal* type = arguments.size() != 3 ? nullptr : context_.GlobalAt(arguments[0]);
  if (type == nullptr) context_.scanner.FailDamaged("has an instance of unknown form");
  switch (type->role) {
    case GlobalRole::kDict:
      return DictOf({arguments[2]});
    case GlobalRole::kList:
      return ListOf({arguments[2]});
    case GlobalRole::kInstance:
      return Instance(arguments[0], std::nullopt);
    default:
      context_.scanner.FailDamaged("has an instance of unknown form");
  }
}

bool PickleCalls::Redirect(const AllowedGlobal*& global, NodeIndex& callee, NodeIndex& arguments) {
  const Arguments& given = *context_.ItemsAt(arguments);
  if (global->role == GlobalRole::kNewObject) {
    if (given.empty()) context_.scanner.FailDamaged("has an instance of unknown form");
    callee = given.front();
    arguments = context_.store.AddList({given.begin() + 1, given.end()});
  } else if (global->role == GlobalRole::kTorchFromType) {
    if (given.size() < 3 || context_.ItemsAt(given[2]) == nullptr) {
      context_.scanner.FailDamaged("has a torch tensor of unknown form");
    }
    callee = given[0];
    arguments = given[2];
  } else {
    return false;
  }
  global = context_.GlobalAt(callee);
  return true;
}

NodeIndex PickleCalls::Call(NodeIndex callee, NodeIndex arguments) {
  const AllowedGlobal* global = context_.GlobalAt(callee);
  if (context_.ItemsAt(arguments) == nullptr) {
    context_.scanner.FailDamaged("calls something without a list of arguments");
  }
  const auto require_name = [&] {
    if (global == nullptr)
      context_.scanner.FailDamaged("calls a value that is neither class nor function");
  };
  require_name();
  if (Redirect(global, callee, arguments)) require_name();
  const Arguments& given = *context_.ItemsAt(arguments);
  switch (global->role) {
    case GlobalRole::kInstance:
    case GlobalRole::kJoblibArray:
      return Instance(callee, arguments);
    case GlobalRole::kList:
      return ListOf(given);
    case GlobalRole::kDict:
      return DictOf(given);
    case GlobalRole::kBytes:
      return BytesOf(given);
    case GlobalRole::kLatin1:
      return Latin1(given);
    case GlobalRole::kPath:
      return Path(given);
    case GlobalRole::kReconstructor:
      return Reconstruct(given);
    case GlobalRole::kNdarray:
    case GlobalRole::kReconstruct:
      return numpy_.EmptyArray();
    case GlobalRole::kFromBuffer:
      return numpy_.FromBuffer(given);
    case GlobalRole::kScalar:
      return numpy_.Scalar(given);
    case GlobalRole::kDtype:
      return numpy_.Dtype(given);
    case GlobalRole::kTorchTensor:
      return torch_.Tensor(given);
    case GlobalRole::kTorchTensor3:
      return torch_.UntypedTensor(given);
    case GlobalRole::kTorchFromBytes:
      return torch_.StorageFromBytes(given);
    case GlobalRole::kTorchParameter:
      if (given.empty()) context_.scanner.FailDamaged("has a torch parameter without a tensor");
      return given.front();
    case GlobalRole::kComplex:
      context_.scanner.FailRefused("holds complex numbers, which are not read",
                                   "Save real and imaginary parts as separate arrays");
    case GlobalRole::kClassOnly:
    case GlobalRole::kTorchStorage:
    case GlobalRole::kNewObject:
    case GlobalRole::kTorchFromType:
      break;
  }
  context_.scanner.FailRefused(
      fmt::format("calls '{}.{}', which does not represent data", global->module, global->name),
      "If you trust the file, load it in Python and save what is needed as arrays (numpy.savez)");
}

void PickleCalls::SetState(NodeIndex object, NodeIndex state) {
  if (numpy_.IsEmptyArray(object)) return numpy_.SetArrayState(object, state);
  if (numpy_.IsDtype(object)) return numpy_.SetDtypeState(object, state);
  ObjectNode* instance = context_.ObjectAt(object);
  // Attributes of a subclass of dict or list (torch's OrderedDict) are not kept.
  if (context_.DictAt(object) != nullptr || context_.ItemsAt(object) != nullptr) return;
  if (instance == nullptr) context_.scanner.FailDamaged("sets fields of a value that has none");
  if (instance->is_class) context_.scanner.FailDamaged("sets fields of a class");
  // For classes with __slots__, the state is a pair of dicts.
  const std::vector<NodeIndex>* pair = context_.ItemsAt(state);
  const bool is_pair = pair != nullptr && pair->size() == 2;
  const NodeIndex parts[2] = {is_pair ? (*pair)[0] : state, is_pair ? (*pair)[1] : NodeIndex{0}};
  for (const NodeIndex part : parts) {
    if (context_.IsNone(part)) continue;
    const DictNode* fields = context_.DictAt(part);
    if (fields == nullptr) {
      SetItem(object, context_.store.AddText("state"), part);
    } else if (!instance->fields) {
      instance->fields = part;
    } else if (*instance->fields != part) {
      for (std::size_t i = 0; i < fields->entries.size(); ++i) {
        context_.store.SetItem(*instance->fields, fields->entries[i].first,
                               fields->entries[i].second);
      }
    }
  }
}

void PickleCalls::SetItem(NodeIndex container, NodeIndex key, NodeIndex value) {
  if (context_.DictAt(container) != nullptr) return context_.store.SetItem(container, key, value);
  ObjectNode* instance = context_.ObjectAt(container);
  if (instance == nullptr || instance->is_class) {
    context_.scanner.FailDamaged("sets an item of a value that is not a dict");
  }
  if (!instance->fields) instance->fields = context_.store.AddDict();
  context_.store.SetItem(*instance->fields, key, value);
}

void PickleCalls::Append(NodeIndex container, NodeIndex item) {
  if (context_.ItemsAt(container) == nullptr) {
    context_.scanner.FailDamaged("appends to a value that is not a list");
  }
  context_.store.Append(container, item);
}

namespace {

// Memo numbers up to this far beyond the memo's end extend it.
constexpr std::uint64_t kMemoGap = 64;
constexpr std::size_t kFarMemoEntry = 64;
constexpr std::size_t kMaxValues = std::size_t{1} << 28;

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
    if (store_.NumNodes() > kMaxValues) {
      scanner_.FailDamaged(fmt::format("holds more than {} values", kMaxValues));
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
    scanner_.FailDamaged("takes a value from an empty stack");
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
  if (marks_.empty()) scanner_.FailDamaged("goes back to a mark that does not exist");
  const auto begin = stack_.begin() + static_cast<std::ptrdiff_t>(marks_.back());
  marks_.pop_back();
  std::vector<NodeIndex> values(begin, stack_.end());
  stack_.erase(begin, stack_.end());
  return values;
}

void PickleMachine::PushInteger(std::string_view decimal) {
  const auto value = ParseDecimal(decimal);
  if (!value) scanner_.FailDamaged("has an unreadable whole number");
  PushWhole(*value);
}

void PickleMachine::PushWhole(const PickleInteger& value) {
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

std::string_view PickleMachine::TextOf(NodeIndex name) const {
  const auto* text = std::get_if<TextNode>(&store_[name]);
  if (text == nullptr) scanner_.FailDamaged("names a class by a value that is not text");
  return text->text;
}

}  // namespace holdfast
