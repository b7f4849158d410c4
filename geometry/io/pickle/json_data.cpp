// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/json_data.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/data_store.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxDepth = 100;

// Builds the values while the text is parsed, which goes without recursion.
class Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(DataStore& store, std::string_view text) : store_(store), text_(text) {}

  /// Where the text begins that is parsed next, in the whole one.
  void BeginAt(std::size_t offset) { offset_ = offset; }

  NodeIndex Root() const { return root_; }

  bool null() override { return Put(store_.AddNone()); }
  bool boolean(bool value) override { return Put(store_.AddBool(value)); }
  bool number_integer(number_integer_t value) override { return Put(store_.AddInteger(value)); }
  bool number_unsigned(number_unsigned_t value) override {
    const bool fits = value <= std::uint64_t{std::numeric_limits<std::int64_t>::max()};
    return Put(fits ? store_.AddInteger(static_cast<std::int64_t>(value))
                    : store_.AddReal(static_cast<double>(value)));
  }
  bool number_float(number_float_t value, const string_t&) override {
    return Put(store_.AddReal(value));
  }
  bool string(string_t& text) override { return Put(store_.AddText(std::move(text))); }
  bool binary(binary_t&) override { return false; }  // of other formats than JSON
  bool start_object(std::size_t) override { return Open(store_.AddDict(), true); }
  bool end_object() override { return Close(); }
  bool start_array(std::size_t) override { return Open(store_.AddList(), false); }
  bool end_array() override { return Close(); }
  bool key(string_t& name) override {
    key_ = store_.AddText(std::move(name));
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception&) override {
    const std::size_t at = std::min(offset_ + (position == 0 ? 0 : position - 1), text_.size());
    std::size_t line = 1, column = 1;
    for (std::size_t i = 0; i < at; ++i) {
      column = text_[i] == '\n' ? 1 : column + 1;
      line += text_[i] == '\n';
    }
    throw Error(store_.Where(),
                at >= text_.size() ? "ends within its JSON"
                                   : fmt::format("is not JSON at line {}, column {}", line, column),
                "Save it again; NaN and Infinity are not JSON");
  }

 private:
  struct Level {
    NodeIndex container;
    bool is_dict;
  };

  bool Put(NodeIndex value) {
    if (open_.empty()) {
      root_ = value;
    } else if (open_.back().is_dict) {
      store_.SetItem(open_.back().container, key_, value);
    } else {
      store_.Append(open_.back().container, value);
    }
    return true;
  }
  bool Open(NodeIndex container, bool is_dict) {
    if (open_.size() == kMaxDepth) {
      throw Error(store_.Where(), fmt::format("is nested more than {} levels deep", kMaxDepth),
                  "Make it flatter");
    }
    Put(container);
    open_.push_back({container, is_dict});
    return true;
  }
  bool Close() {
    open_.pop_back();
    return true;
  }

  DataStore& store_;
  std::string_view text_;
  std::size_t offset_ = 0;
  std::vector<Level> open_;
  NodeIndex key_ = 0;
  NodeIndex root_ = 0;
};

// The text of a line from `at` on, which moves behind it.
std::string_view NextLine(std::string_view text, std::size_t& at) {
  const std::size_t end = std::min(text.find('\n', at), text.size());
  const std::string_view line = text.substr(at, end - at);
  at = end + 1;
  return line;
}

bool IsBlank(std::string_view text) {
  return text.find_first_not_of(" \t\r\n") == std::string_view::npos;
}

}  // namespace

bool IsJsonLines(std::string_view text) {
  std::size_t at = 0;
  const std::string_view first = NextLine(text, at);
  return at < text.size() && !IsBlank(text.substr(at)) && nlohmann::json::accept(first);
}

DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit) {
  auto store = std::make_shared<DataStore>(where, memory_limit);
  Builder builder(*store, text);
  if (IsJsonLines(text)) {
    builder.start_array(0);
    for (std::size_t at = 0; at < text.size();) {
      builder.BeginAt(at);
      const std::string_view line = NextLine(text, at);
      if (!IsBlank(line)) nlohmann::json::sax_parse(line, &builder);
    }
    builder.end_array();
  } else {
    nlohmann::json::sax_parse(text, &builder);
  }
  store->Finish();
  return DataValue(std::move(store), builder.Root(), where);
}

}  // namespace holdfast
