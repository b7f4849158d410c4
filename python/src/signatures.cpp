// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "python/src/bindings.h"

namespace holdfast::python {
namespace {

// The function behind an attribute of a module or class, or null.
PyCFunctionObject* FunctionOf(PyObject* item) {
  if (PyInstanceMethod_Check(item)) item = PyInstanceMethod_GET_FUNCTION(item);
  if (Py_TYPE(item) == &PyStaticMethod_Type) {
    item = py::getattr(item, "__func__").ptr();  // owned by the static method
  }
  return PyCFunction_Check(item) ? reinterpret_cast<PyCFunctionObject*>(item) : nullptr;
}

// Splits "a: int = 1, b: Tuple[int, int] = (1, 2)" at its outer commas.
std::vector<std::string> Parameters(std::string_view list) {
  std::vector<std::string> parts(1);
  int depth = 0;
  char quote = 0;
  for (const char c : list) {
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == '[' || c == '(' || c == '{') {
      ++depth;
    } else if (c == ']' || c == ')' || c == '}') {
      --depth;
    } else if (c == ',' && depth == 0) {
      parts.emplace_back();
      continue;
    }
    if (parts.back().empty() && c == ' ') continue;
    parts.back() += c;
  }
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

// "a: int = 1" without its type.
std::string WithoutType(const std::string& parameter) {
  const std::size_t type = parameter.find(':'), value = parameter.find(" = ");
  std::string name = parameter.substr(0, std::min(type, value));
  return value == std::string::npos ? name : name + "=" + parameter.substr(value + 3);
}

// "name=default" of the lines "name (kind; default): help" that follow "Options:" (OptionsText).
std::vector<std::string> OptionsIn(std::string_view doc) {
  constexpr std::string_view kBegin = "\nOptions:\n";
  std::vector<std::string> options;
  const std::size_t begin = doc.find(kBegin);
  if (begin == std::string_view::npos) return options;
  std::string_view rest = doc.substr(begin + kBegin.size());
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const std::size_t open = line.find(" ("), close = line.find("): ");
    if (open == std::string_view::npos || close == std::string_view::npos) continue;
    const std::string_view told = line.substr(open + 2, close - open - 2);
    const std::size_t value = told.rfind("; ");
    const bool none = told.starts_with("None: ") || told.find("; None: ") != std::string_view::npos;
    options.push_back(std::string(line.substr(0, open)) + "=" +
                      std::string(none                              ? "None"
                                  : value == std::string_view::npos ? told
                                                                    : told.substr(value + 2)));
  }
  return options;
}

// pybind11 begins a text with "name(a: int = 1) -> str". Python reads signatures from texts that
// begin with "name(a=1)\n--\n\n". Empty if there is no such line.
std::string WithSignature(std::string_view doc) {
  const std::size_t line = doc.find("\n"), open = doc.find('(');
  const std::size_t arrow = doc.substr(0, line).rfind(") -> ");
  if (arrow == std::string_view::npos || open == std::string_view::npos || open > arrow) return {};
  const std::vector<std::string> options = OptionsIn(doc);
  std::vector<std::string> parameters;
  bool keyword_only = false;
  for (const std::string& parameter : Parameters(doc.substr(open + 1, arrow - open - 1))) {
    keyword_only = keyword_only || parameter == "*";
    if (parameter == "**kwargs" && !options.empty()) {
      if (!keyword_only) parameters.emplace_back("*");
      parameters.insert(parameters.end(), options.begin(), options.end());
      continue;
    }
    parameters.push_back(WithoutType(parameter));
  }
  std::string text(doc.substr(0, open + 1));
  for (std::size_t k = 0; k < parameters.size(); ++k) text += (k > 0 ? ", " : "") + parameters[k];
  text += ")\n--\n\n";
  const std::size_t rest = doc.find_first_not_of('\n', line);
  return rest == std::string_view::npos ? text : text + std::string(doc.substr(rest));
}

void Give(PyCFunctionObject& function) {
  const char*& doc = function.m_ml->ml_doc;
  if (doc == nullptr) return;
  const std::string text = WithSignature(doc);
  if (text.empty()) return;
  std::free(const_cast<char*>(doc));  // as pybind11 frees it
  doc = strdup(text.c_str());
}

}  // namespace

void GiveSignatures(py::module_& module) {
  for (const auto& [name, item] : py::dict(module.attr("__dict__"))) {
    if (PyCFunctionObject* const function = FunctionOf(item.ptr())) {
      Give(*function);
    }
    if (!PyType_Check(item.ptr())) continue;
    for (const auto& [member_name, member] : py::dict(py::getattr(item, "__dict__"))) {
      if (PyCFunctionObject* const function = FunctionOf(member.ptr())) {
        Give(*function);
      }
    }
  }
}

}  // namespace holdfast::python
