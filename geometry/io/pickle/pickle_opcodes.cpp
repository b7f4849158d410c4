// SPDX-License-Identifier: MIT
// Implements the opcodes, in groups; pickle_machine.cpp has the stack and the memo.
#include <bit>
#include <limits>

#include <fmt/format.h>

#include "geometry/io/pickle/pickle_machine.h"
#include "geometry/io/pickle/pickle_text.h"

namespace holdfast {
namespace {

constexpr unsigned kNewestProtocol = 5;

}  // namespace

bool PickleMachine::RunNumber(unsigned char opcode) {
  switch (opcode) {
    case 'N':
      Push(store_.AddNone());
      return true;
    case 0x88:
    case 0x89:
      Push(store_.AddBool(opcode == 0x88));
      return true;
    case 'I': {  // also protocol 0's form of booleans
      const std::string_view line = scanner_.Line();
      if (line == "00" || line == "01") {
        Push(store_.AddBool(line == "01"));
      } else {
        PushInteger(line);
      }
      return true;
    }
    case 'L':
      PushInteger(scanner_.Line());
      return true;
    case 'J':
      Push(store_.AddInteger(static_cast<std::int32_t>(scanner_.Unsigned(4))));
      return true;
    case 'K': {  // by far the most frequent: one node per value
      const unsigned char value = scanner_.Byte();
      if (small_integers_.empty()) small_integers_.assign(256, kNoValue);
      NodeIndex& node = small_integers_[value];
      if (node == kNoValue) node = store_.AddInteger(value);
      Push(node);
      return true;
    }
    case 'M':
      Push(store_.AddInteger(static_cast<std::int64_t>(scanner_.Unsigned(2))));
      return true;
    case 0x8a:
      PushWhole(ParseTwosComplement(scanner_.Counted(1)));
      return true;
    case 0x8b: {
      const std::uint64_t length = scanner_.Unsigned(4);
      if (length > std::numeric_limits<std::int32_t>::max()) {
        scanner_.FailDamaged("has an integer of negative length");
      }
      PushWhole(ParseTwosComplement(scanner_.Take(length)));
      return true;
    }
    case 'F': {
      const auto value = ParseReal(scanner_.Line());
      if (!value) scanner_.FailDamaged("has an unreadable number");
      Push(store_.AddReal(*value));
      return true;
    }
    case 'G': {
      std::uint64_t bits = 0;
      for (const char byte : scanner_.Take(8)) bits = bits << 8 | static_cast<std::uint8_t>(byte);
      Push(store_.AddReal(std::bit_cast<double>(bits)));
      return true;
    }
    default:
      return false;
  }
}

bool PickleMachine::RunText(unsigned char opcode) {
  switch (opcode) {
    case 'S': {
      auto text = DecodeStringLiteral(scanner_.Line());
      if (!text) scanner_.FailDamaged("has a text without quotes, or with a broken escape");
      Push(store_.AddBytes(*std::move(text), true));
      return true;
    }
    case 'T':
    case 'U':
      Push(store_.AddBytesView(scanner_.Counted(opcode == 'T' ? 4 : 1), true));
      return true;
    case 'V': {
      auto text = DecodeRawUnicode(scanner_.Line());
      if (!text) scanner_.FailDamaged("has a text with a broken escape");
      Push(store_.AddText(*std::move(text)));
      return true;
    }
    case 0x8c:
      PushUnicode(scanner_.Counted(1));
      return true;
    case 'X':
      PushUnicode(scanner_.Counted(4));
      return true;
    case 0x8d:
      PushUnicode(scanner_.Counted(8));
      return true;
    case 'C':
      Push(store_.AddBytesView(scanner_.Counted(1)));
      return true;
    case 'B':
      Push(store_.AddBytesView(scanner_.Counted(4)));
      return true;
    case 0x8e:
    case 0x96:
      Push(store_.AddBytesView(scanner_.Counted(8)));
      return true;
    case 0x97:
      scanner_.FailRefused("needs buffers that lie outside of the file (protocol 5)",
                           "Save it without buffer_callback");
    case 0x98:  // marks a buffer as read-only, as all are here
      Top();
      return true;
    default:
      return false;
  }
}

bool PickleMachine::RunContainer(unsigned char opcode) {
  switch (opcode) {
    case ']':
    case ')':
    case 0x8f:
      Push(store_.AddList());
      return true;
    case '}':
      Push(store_.AddDict());
      return true;
    case 't':
    case 'l':
    case 0x91: {
      std::vector<NodeIndex> items = PopToMark();
      Push(store_.AddList(std::move(items)));
      return true;
    }
    case 0x85:
    case 0x86:
    case 0x87:
      PushTuple(opcode - 0x84);
      return true;
    case 'd': {
      const std::vector<NodeIndex> items = PopToMark();
      Push(store_.AddDict());
      SetItems(items);
      return true;
    }
    case 'a': {
      const NodeIndex item = Pop();
      calls_.Append(Top(), item);
      return true;
    }
    case 'e':
    case 0x90:
      for (const NodeIndex item : PopToMark()) calls_.Append(Top(), item);
      Top();
      return true;
    case 's': {
      NodeIndex pair[2];
      PopMany(pair, 2);
      calls_.SetItem(Top(), pair[0], pair[1]);
      return true;
    }
    case 'u':
      SetItems(PopToMark());
      return true;
    default:
      return false;
  }
}

bool PickleMachine::RunMemoOrStack(unsigned char opcode) {
  switch (opcode) {
    case '(':
      PushMark();
      return true;
    case '0':
      if (!marks_.empty() && marks_.back() == stack_.size()) {
        marks_.pop_back();
      } else {
        Pop();
      }
      return true;
    case '1':
      PopToMark();
      return true;
    case '2':
      Push(Top());
      return true;
    case 'p':
      Memoize(DecimalPlace());
      return true;
    case 'q':
      Memoize(scanner_.Unsigned(1));
      return true;
    case 'r':
      Memoize(scanner_.Unsigned(4));
      return true;
    case 0x94:
      Memoize(memo_size_);
      return true;
    case 'g':
      PushMemo(DecimalPlace());
      return true;
    case 'h':
      PushMemo(scanner_.Unsigned(1));
      return true;
    case 'j':
      PushMemo(scanner_.Unsigned(4));
      return true;
    case 0x80: {
      const unsigned protocol = scanner_.Byte();
      if (protocol > kNewestProtocol) {
        scanner_.FailRefused(
            fmt::format("is a pickle of protocol {}, newer than the fifth", protocol),
            "Save it again with protocol=5");
      }
      return true;
    }
    case 0x95: {  // states only how much may be read at once
      const std::uint64_t length = scanner_.Unsigned(8);
      if (length > scanner_.Left()) {
        scanner_.FailDamaged(
            fmt::format("announces {} bytes where {} are left", length, scanner_.Left()));
      }
      return true;
    }
    default:
      return false;
  }
}

bool PickleMachine::RunCall(unsigned char opcode) {
  switch (opcode) {
    case 'c': {
      const std::string_view module = scanner_.Line();
      Push(calls_.Global(module, scanner_.Line()));
      return true;
    }
    case 0x93: {
      NodeIndex names[2];
      PopMany(names, 2);
      Push(calls_.Global(TextOf(names[0]), TextOf(names[1])));
      return true;
    }
    case 'R':
    case 0x81: {
      NodeIndex call[2];
      PopMany(call, 2);
      Push(calls_.Call(call[0], call[1]));
      return true;
    }
    case 0x92: {  // keyword arguments do not matter for plain data
      NodeIndex call[3];
      PopMany(call, 3);
      Push(calls_.Call(call[0], call[1]));
      return true;
    }
    case 'i': {
      const std::string_view module = scanner_.Line();
      const NodeIndex callee = calls_.Global(module, scanner_.Line());
      Push(calls_.Call(callee, store_.AddList(PopToMark())));
      return true;
    }
    case 'o': {
      const std::vector<NodeIndex> call = PopToMark();
      if (call.empty()) scanner_.FailDamaged("has an instance of no class");
      Push(calls_.Call(call.front(), store_.AddList({call.begin() + 1, call.end()})));
      return true;
    }
    case 'b': {
      const NodeIndex state = Pop();
      calls_.SetState(Top(), state);
      // joblib writes the numbers of an array into the pickle, behind its description.
      if (calls_.Numpy().IsJoblibArray(Top())) Top() = calls_.Numpy().JoblibArray(Top(), scanner_);
      return true;
    }
    case 'P':
      Push(calls_.PersistentId(store_.AddTextView(scanner_.Line())));
      return true;
    case 'Q':
      Push(calls_.PersistentId(Pop()));
      return true;
    default:
      return false;
  }
}

}  // namespace holdfast
