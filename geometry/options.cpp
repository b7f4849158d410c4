// SPDX-License-Identifier: MIT
#include "geometry/options.h"

#include <algorithm>
#include <string>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"

namespace holdfast {
namespace {

template <typename T>
std::optional<std::size_t> FindBeyond(std::span<const T> values, double most) {
  constexpr std::size_t kBlock = 4096;
  for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
    const auto block = values.subspan(begin, std::min(kBlock, values.size() - begin));
    const Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>> x(
        block.data(), static_cast<Eigen::Index>(block.size()));
    if (IsWithin(x.abs().template maxCoeff<Eigen::PropagateNaN>(), most)) continue;
    const auto bad = std::ranges::find_if(block, [&](T value) { return !IsWithin(value, most); });
    return begin + static_cast<std::size_t>(bad - block.begin());
  }
  return std::nullopt;
}

}  // namespace

void RequireWithin(const Eigen::Ref<const Eigen::MatrixXd>& values, double most,
                   std::string_view where, std::string_view field, std::string_view column_is,
                   std::string_view remedy) {
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    for (Eigen::Index r = 0; r < values.rows(); ++r) {
      if (IsWithin(values(r, c), most)) continue;
      throw Error(fmt::format("{}[{}]", where, field),
                  fmt::format("holds {:g} in {} {}", values(r, c), column_is, c), remedy);
    }
  }
}

void RequireFrameRate(double rate, std::string_view where) {
  if (rate >= kLowestFrameRate && rate <= kHighestFrameRate) return;
  throw Error(where, fmt::format("has {:g} frames per second", rate),
              "Give 1 to 10,000 (set the rate with import --source-fps)");
}

std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most) {
  return FindBeyond(values, most);
}
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most) {
  return FindBeyond(values, most);
}

namespace {

template <typename T>
inline constexpr bool kIsOptional = false;
template <typename T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

nlohmann::json ValueOf(const Option& option) {
  return std::visit(
      [](const auto& value) -> nlohmann::json {
        using Value = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, OptionChoice>) {
          return value.words[value.get()];
        } else if constexpr (std::is_same_v<Value, ScaledNumber>) {
          return *value.variable / value.unit;
        } else if constexpr (kIsOptional<std::remove_pointer_t<Value>>) {
          return *value ? nlohmann::json(**value) : nlohmann::json();
        } else {
          return *value;
        }
      },
      option.value);
}

// The type of a value and its valid range: "float, more than 0".
std::string TypeText(const Option& option) {
  if (const auto* choice = std::get_if<OptionChoice>(&option.value)) {
    return fmt::format("{{'{}'}}", fmt::join(choice->words, "', '"));
  }
  if (std::holds_alternative<std::vector<int>*>(option.value)) return "array_like (n,) of int";
  if (std::holds_alternative<std::string*>(option.value)) return "str";
  if (std::holds_alternative<bool*>(option.value)) return "bool";
  const bool whole = std::holds_alternative<int*>(option.value) ||
                     std::holds_alternative<std::optional<int>*>(option.value);
  const bool pair = std::holds_alternative<std::pair<int, int>*>(option.value);
  const std::string type = pair ? "(int, int)" : whole ? "int" : "float";
  const OptionRange& range = option.range;
  if (range.positive) return type + ", more than 0";
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high) return fmt::format("{}, {:g} to {:g}", type, range.low, range.high);
  return low ? fmt::format("{}, {:g} or more", type, range.low) : type;
}

// Breaks a text into lines of at most 96 characters, which begin with four spaces.
std::string Indented(std::string_view text) {
  std::string lines = "   ";
  std::size_t begin = 0;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), word.size() + 1));
    if (lines.size() - begin + 1 + word.size() > 96) {
      begin = lines.size() + 1;
      lines += "\n   ";
    }
    lines.append(" ").append(word);
  }
  return lines;
}

// The default in Python.
std::string DefaultText(const Option& option) {
  if (const auto* const pair = std::get_if<std::pair<int, int>*>(&option.value)) {
    return fmt::format("({}, {})", (*pair)->first, (*pair)->second);
  }
  const nlohmann::json value = ValueOf(option);
  if (value.is_boolean()) return value.get<bool>() ? "True" : "False";
  if (value.is_string()) return fmt::format("'{}'", value.get<std::string>());
  return value.is_null() ? "None" : value.dump();
}

}  // namespace

Option& OptionTable::Add(const std::string& name, const std::string& unit, OptionRange range,
                         std::string help) {
  Option& option = options_.emplace_back();
  option.name = unit.empty() ? name : name + "_" + unit;
  option.flag = "--" + name;
  std::ranges::replace(option.flag, '_', '-');
  option.help = std::move(help);
  option.group = group_;
  option.range = range;
  return option;
}

void OptionTable::Flag(const std::string& name, bool& variable, std::string help) {
  Option& option = Add(name, "", {}, std::move(help));
  if (variable) option.flag.insert(2, "no-");
  option.value = &variable;
}

void OptionTable::Frames(const std::string& name, std::string flag, std::vector<int>& variable,
                         std::string help) {
  Option& option = Add(name, "", kNonNegative, std::move(help));
  option.value = &variable;
  option.flag = std::move(flag);
}

void OptionTable::Pair(const std::string& name, std::pair<int, int>& variable, OptionRange range,
                       std::string help) {
  Add(name, "", range, std::move(help)).value = &variable;
}

void OptionTable::Text(const std::string& name, std::string& variable, std::string help) {
  Add(name, "", {}, std::move(help)).value = &variable;
}

const Option* OptionTable::Find(const std::string& name) const {
  const auto found = std::ranges::find(options_, name, &Option::name);
  return found == options_.end() ? nullptr : &*found;
}

OptionTable OptionTable::Without(const std::vector<std::string>& names) const {
  OptionTable rest = *this;
  std::erase_if(rest.options_, [&](const Option& option) {
    return std::ranges::find(names, option.name) != names.end();
  });
  return rest;
}

OptionTable OptionTable::Only(const std::vector<std::string>& names) const {
  OptionTable some = *this;
  std::erase_if(some.options_, [&](const Option& option) {
    return std::ranges::find(names, option.name) == names.end();
  });
  return some;
}

nlohmann::json OptionsJson(const OptionTable& table) {
  nlohmann::json json;
  for (const Option& option : table.All()) json[option.name] = ValueOf(option);
  return json;
}

std::string OptionsText(const OptionTable& table) {
  std::string text;
  for (const Option& option : table.All()) {
    const std::string usual = DefaultText(option);
    const std::string none =
        usual == "None" ? fmt::format(" None: {}.", option.default_text) : std::string();
    text += fmt::format("{} : {}, default {}\n{}\n", option.name, TypeText(option), usual,
                        Indented(option.help + "." + none));
  }
  return text;
}

}  // namespace holdfast
