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
    const std::size_t at = position == 0 ? 0 : std::min(position - 1, text_.size());
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
  std::vector<Level> open_;
  NodeIndex key_ = 0;
  NodeIndex root_ = 0;
};

}  // namespace

DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit) {
  auto store = std::make_shared<DataStore>(where, memory_limit);
  Builder builder(*store, text);
  nlohmann::json::sax_parse(text, &builder);
  store->Finish();
  return DataValue(std::move(store), builder.Root(), where);
}

}  // namespace holdfast
