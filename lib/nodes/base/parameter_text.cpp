#include "xplane_bridge/nodes/base/parameter_text.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

using XmlRpc::XmlRpcValue;

constexpr const char* kOfTheMachine[] = {"host", "port", "data_port", "beacon_port"};
// Recordings are given to others. Those of src/xplane_bridge/wire_log/anonymous.py, too.
constexpr const char* kSecrets[] = {"token"};

template <class T>
T as(const XmlRpcValue& value) {
  XmlRpcValue copy = value;  // its conversions are not const
  return static_cast<T>(copy);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char letter : text) {
    constexpr unsigned char kFirstPrintable = 0x20;
    if (letter == '"' || letter == '\\') {
      out += '\\';
      out += letter;
    } else if (letter == '\n') {
      out += "\\n";
    } else if (static_cast<unsigned char>(letter) < kFirstPrintable) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04x", static_cast<unsigned>(letter));
      out += code.data();
    } else {
      out += letter;
    }
  }
  return out + '"';
}

// The shortest that reads back as the same number.
std::string numberText(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text{};
  constexpr int kShortest = 6;
  constexpr int kExact = 17;
  for (int digits = kShortest; digits <= kExact; ++digits) {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
    if (std::abs(std::strtod(text.data(), nullptr) - value) <= 0.0) break;
  }
  std::string out = text.data();
  if (out.find_first_of(".e") == std::string::npos) out += ".0";  // no integer
  return out;
}

// "/a/file" to "file", where there is one; texts of other kinds may begin with a slash, too.
std::string withoutFolder(const std::string& text) {
  if (text.empty() || text.front() != '/' || access(text.c_str(), F_OK) != 0) return text;
  const std::string path = text.substr(0, text.find_last_not_of('/') + 1);
  return core::afterLastSlash(path);
}

XmlRpcValue withoutFolders(const XmlRpcValue& value) {
  XmlRpcValue out = value;
  if (value.getType() == XmlRpcValue::TypeString) {
    out = withoutFolder(as<std::string>(value));
  } else if (value.getType() == XmlRpcValue::TypeArray) {
    for (int i = 0; i < out.size(); ++i) out[i] = withoutFolders(out[i]);
  } else if (value.getType() == XmlRpcValue::TypeStruct) {
    for (auto& entry : out) entry.second = withoutFolders(entry.second);
  }
  return out;
}

}  // namespace

std::string parameterText(const XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean:
      return as<bool>(value) ? "true" : "false";
    case XmlRpcValue::TypeInt:
      return std::to_string(as<int>(value));
    case XmlRpcValue::TypeDouble:
      return numberText(as<double>(value));
    case XmlRpcValue::TypeString:
      return quoted(as<std::string>(value));
    case XmlRpcValue::TypeArray: {
      std::string out = "[";
      for (int i = 0; i < value.size(); ++i) out += (i > 0 ? ", " : "") + parameterText(value[i]);
      return out + "]";
    }
    case XmlRpcValue::TypeStruct:
      return "{" +
             core::join(value, ", ",
                        [](const auto& entry) { return quoted(entry.first) + ": " + parameterText(entry.second); }) +
             "}";
    default:
      return "null";
  }
}

XmlRpcValue withoutMachine(const XmlRpcValue& parameters) {
  if (parameters.getType() != XmlRpcValue::TypeStruct) return parameters;
  XmlRpcValue out;
  out.begin();  // a struct, also without an entry
  for (const auto& [key, value] : parameters) {
    const bool of_the_machine =
        std::find(std::begin(kOfTheMachine), std::end(kOfTheMachine), key) != std::end(kOfTheMachine);
    if (!of_the_machine) out[key] = withoutFolders(value);
  }
  return out;
}

bool isSecret(const std::string& key) {
  return std::find(std::begin(kSecrets), std::end(kSecrets), key) != std::end(kSecrets);
}

XmlRpcValue withoutSecrets(const XmlRpcValue& parameters) {
  XmlRpcValue out = parameters;
  if (parameters.getType() == XmlRpcValue::TypeArray) {
    for (int i = 0; i < out.size(); ++i) out[i] = withoutSecrets(out[i]);
  } else if (parameters.getType() == XmlRpcValue::TypeStruct) {
    for (auto& [key, value] : out) {
      const bool unset = value.getType() == XmlRpcValue::TypeString && as<std::string>(value).empty();
      value = isSecret(key) && !unset ? XmlRpcValue(kSecret) : withoutSecrets(value);
    }
  }
  return out;
}

}  // namespace xplane_bridge
