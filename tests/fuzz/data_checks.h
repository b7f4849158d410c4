// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <string>
#include <utility>

#include "geometry/error.h"
#include "geometry/io/container/data_value.h"
#include "tests/fuzz/fuzz_target.h"

namespace holdfast::fuzz {

/// Asks one value for all that it may be asked for, whatever it is. An Error is an answer.
/// `with_numbers`: also for an array.
inline void Interrogate(const DataValue& value, bool with_numbers) {
  const auto ask = [](auto&& question) {
    try {
      question();
    } catch (const Error&) {
      return;
    }
  };
  Require(!value.Where().empty(), "a value knows where it is from");
  Require(!value.Describe().empty(), "a value can be described");
  ask([&] { value.Text(); });
  if (!with_numbers) return;
  bool gives_numbers = false;
  ask([&] {
    const NpyMember member = value.Array();
    const NpyArray& array = member.array;
    Require(array.data.size() == array.NumElements() * array.item_size,
            "an array holds as many bytes as its shape says");
    if (array.kind == 'U' || array.kind == 'S') return;
    gives_numbers = true;
    Require(member.AsDoubles().size() == array.NumElements(), "one number per element");
    ask([&] { value.Number(); });
    ask([&] { value.Integer(); });
  });
  // Not the other way round: an array stretched over few bytes may be refused for its size.
  Require(!gives_numbers || value.HoldsNumbers(), "what gives numbers holds them");
}

/// Walks through what was read, as far as a few hundred values: they may be in loops. Lists are
/// asked for numbers only at first: in nested ones that share their items this takes some time.
inline void InterrogateAll(const DataValue& root) {
  constexpr int kMaxValues = 200;
  constexpr std::size_t kMaxChildren = 40;
  int lists_left = 2;
  std::deque<DataValue> open{root};
  for (int seen = 0; seen < kMaxValues && !open.empty(); ++seen) {
    const DataValue value = std::move(open.front());
    open.pop_front();
    const DataKind kind = value.Kind();
    const bool nests = kind == DataKind::kList || kind == DataKind::kObject;
    Interrogate(value, !nests || lists_left-- > 0);
    const std::vector<std::string> names = value.Names();
    for (std::size_t i = 0; i < std::min(names.size(), kMaxChildren); ++i) {
      Require(value.Has(names[i]), "a value has what it lists");
      open.push_back(value[names[i]]);
    }
    for (std::size_t i = 0; i < std::min(value.Size(), kMaxChildren); ++i) {
      open.push_back(value[i]);
    }
  }
}

}  // namespace holdfast::fuzz
