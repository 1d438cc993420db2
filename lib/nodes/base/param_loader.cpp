#include "xplane_bridge/nodes/base/param_loader.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <ros/param.h>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/nodes/base/parameter_text.hpp"

namespace xplane_bridge {
namespace {

using XmlRpc::XmlRpcValue;

const char* typeName(XmlRpcValue::Type type) {
  switch (type) {
    case XmlRpcValue::TypeBoolean:
      return "a boolean";
    case XmlRpcValue::TypeInt:
      return "an integer";
    case XmlRpcValue::TypeDouble:
      return "a number";
    case XmlRpcValue::TypeString:
      return "a text";
    case XmlRpcValue::TypeArray:
      return "a list";
    case XmlRpcValue::TypeStruct:
      return "a map";
    default:
      return "of an unsupported type";
  }
}

template <typename T>
T as(const XmlRpcValue& value) {
  return static_cast<const T&>(value);
}

std::string show(const XmlRpcValue& value) {
  std::ostringstream out;
  switch (value.getType()) {
    case XmlRpcValue::TypeString:
      out << '"' << as<std::string>(value) << '"';
      break;
    case XmlRpcValue::TypeBoolean:
      out << (as<bool>(value) ? "true" : "false");
      break;
    case XmlRpcValue::TypeInt:
      out << as<int>(value);
      break;
    case XmlRpcValue::TypeDouble:
      out << as<double>(value);
      break;
    default:
      out << typeName(value.getType());
  }
  return out.str();
}

/// As show(), but for a secret, which the log must not have.
std::string showValueOf(const std::string& key, const XmlRpcValue& value) {
  return isSecret(core::afterLastSlash(key)) ? kSecret : show(value);
}

/// As show(), but lists with their elements.
std::string showAll(const XmlRpcValue& value) {
  if (value.getType() != XmlRpcValue::TypeArray) {
    return show(value);
  }
  std::string out;
  for (int i = 0; i < value.size(); ++i) {
    out += (i > 0 ? ", " : "") + showAll(value[i]);
  }
  return "[" + out + "]";
}

template <typename T>
std::string describe(const char* kind, Range<T> range) {
  std::ostringstream out;
  out << kind;
  const bool bounded_below = range.lowest != std::numeric_limits<T>::lowest();
  const bool bounded_above = range.highest != std::numeric_limits<T>::max();
  if (bounded_below && bounded_above) {
    out << " from " << range.lowest << " to " << range.highest;
  } else if (bounded_below) {
    out << " of at least " << range.lowest;
  } else if (bounded_above) {
    out << " of at most " << range.highest;
  }
  return out.str();
}

[[noreturn]] void throwBad(const std::string& full_key, const XmlRpcValue& given, const std::string& wanted) {
  std::string hint;
  if (given.getType() == XmlRpcValue::TypeString && wanted.find("text") == std::string::npos &&
      wanted.find("one of") == std::string::npos) {
    hint = " (in YAML, quotes make a text, and so does an exponent without a decimal point: write 1.0e-3)";
  }
  throw ParamError("parameter " + full_key + " is " + showValueOf(full_key, given) + ", but must be " + wanted + hint +
                   "; correct it in the YAML or launch file, or with: rosparam set " + full_key + " VALUE");
}

bool booleanFrom(const std::string& full_key, const XmlRpcValue& value) {
  if (value.getType() != XmlRpcValue::TypeBoolean) {
    throwBad(full_key, value, "true or false");
  }
  return as<bool>(value);
}

int integerFrom(const std::string& full_key, const XmlRpcValue& value, Range<int> range) {
  if (value.getType() != XmlRpcValue::TypeInt || as<int>(value) < range.lowest || as<int>(value) > range.highest) {
    throwBad(full_key, value, describe("an integer", range));
  }
  return as<int>(value);
}

double numberFrom(const std::string& full_key, const XmlRpcValue& value, Range<double> range) {
  double number = std::numeric_limits<double>::quiet_NaN();
  if (value.getType() == XmlRpcValue::TypeDouble) {
    number = as<double>(value);
  } else if (value.getType() == XmlRpcValue::TypeInt) {
    number = as<int>(value);
  }
  if (!std::isfinite(number) || number < range.lowest || number > range.highest) {
    throwBad(full_key, value, describe("a number", range));
  }
  return number;
}

std::string textFrom(const std::string& full_key, const XmlRpcValue& value) {
  if (value.getType() != XmlRpcValue::TypeString) {
    throwBad(full_key, value, "a text (quote it in the YAML file if it looks like a number)");
  }
  return as<std::string>(value);
}

std::string choiceFrom(const std::string& full_key, const XmlRpcValue& value, const std::vector<std::string>& allowed) {
  if (value.getType() != XmlRpcValue::TypeString ||
      std::find(allowed.begin(), allowed.end(), as<std::string>(value)) == allowed.end()) {
    throwBad(full_key, value, "one of: " + core::join(allowed));
  }
  return as<std::string>(value);
}

// Insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b`.
size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> edits(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        edits[i][j] = i + j;
        continue;
      }
      const size_t substituted = edits[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      edits[i][j] = std::min({edits[i - 1][j] + 1, edits[i][j - 1] + 1, substituted});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        edits[i][j] = std::min(edits[i][j], edits[i - 2][j - 2] + 1);
      }
    }
  }
  return edits.back().back();
}

std::string element(const std::string& key, int index) { return key + "[" + std::to_string(index) + "]"; }

}  // namespace

ParamLoader::ParamLoader(std::string prefix, const XmlRpcValue& tree)
    : prefix_(std::move(prefix)), tree_(tree), record_(std::make_shared<Record>()) {
  if (tree_.valid() && tree_.getType() != XmlRpcValue::TypeStruct) {
    throwBad(prefix_, tree_, "a map of keys and values");
  }
}

ParamLoader ParamLoader::fromServer(const std::string& ns) {
  XmlRpcValue tree;
  ros::param::get(ns, tree);
  return ParamLoader(ns, tree);
}

std::string ParamLoader::fullKey(const std::string& key) const {
  return (prefix_.empty() || prefix_.back() != '/') ? prefix_ + "/" + key : prefix_ + key;
}

const XmlRpcValue* ParamLoader::find(const std::string& key) const {
  record_->known.insert(key);
  if (!tree_.valid() || !tree_.hasMember(key)) {
    return nullptr;
  }
  return &tree_[key];
}

const XmlRpcValue& ParamLoader::require(const std::string& key) const {
  const XmlRpcValue* value = find(key);
  if (value == nullptr) {
    throw ParamError("parameter " + fullKey(key) +
                     " is required but not set; set it in the YAML or launch file, or with: rosparam set " +
                     fullKey(key) + " VALUE");
  }
  return *value;
}

bool ParamLoader::has(const std::string& key) const { return find(key) != nullptr; }

const XmlRpcValue& ParamLoader::requireGiven(const std::string& key) const {
  const XmlRpcValue& value = require(key);
  record_->given.push_back(key);
  return value;
}

template <typename T, typename Read>
T ParamLoader::readOr(const std::string& key, const T& fallback, const Read& read) const {
  const XmlRpcValue* const value = find(key);
  if (value == nullptr) {
    return fallback;
  }
  T result = read(*value);
  if (result != fallback) {
    record_->given.push_back(key);
  }
  return result;
}

bool ParamLoader::boolean(const std::string& key) const { return booleanFrom(fullKey(key), requireGiven(key)); }

bool ParamLoader::boolean(const std::string& key, bool fallback) const {
  return readOr(key, fallback, [&](const XmlRpcValue& value) { return booleanFrom(fullKey(key), value); });
}

int ParamLoader::integer(const std::string& key, Range<int> range) const {
  return integerFrom(fullKey(key), requireGiven(key), range);
}

int ParamLoader::integer(const std::string& key, Range<int> range, int fallback) const {
  return readOr(key, fallback, [&](const XmlRpcValue& value) { return integerFrom(fullKey(key), value, range); });
}

double ParamLoader::number(const std::string& key, Range<double> range) const {
  return numberFrom(fullKey(key), requireGiven(key), range);
}

double ParamLoader::number(const std::string& key, Range<double> range, double fallback) const {
  return readOr(key, fallback, [&](const XmlRpcValue& value) { return numberFrom(fullKey(key), value, range); });
}

std::string ParamLoader::text(const std::string& key) const { return textFrom(fullKey(key), requireGiven(key)); }

std::string ParamLoader::text(const std::string& key, const std::string& fallback) const {
  return readOr(key, fallback, [&](const XmlRpcValue& value) { return textFrom(fullKey(key), value); });
}

std::string ParamLoader::choice(const std::string& key, const std::vector<std::string>& allowed) const {
  return choiceFrom(fullKey(key), requireGiven(key), allowed);
}

std::string ParamLoader::choice(const std::string& key, const std::vector<std::string>& allowed,
                                const std::string& fallback) const {
  return readOr(key, fallback, [&](const XmlRpcValue& value) { return choiceFrom(fullKey(key), value, allowed); });
}

std::vector<double> ParamLoader::numbers(const std::string& key, Range<double> range) const {
  std::vector<double> result;
  if (const XmlRpcValue* list = find(key)) {
    if (list->getType() != XmlRpcValue::TypeArray) {
      throwBad(fullKey(key), *list, "a list of numbers");
    }
    if (list->size() > 0) {
      record_->given.push_back(key);
    }
    for (int i = 0; i < list->size(); ++i) {
      result.push_back(numberFrom(fullKey(element(key, i)), (*list)[i], range));
    }
  }
  return result;
}

std::vector<std::string> ParamLoader::textList(const std::string& key) const {
  std::vector<std::string> result;
  if (const XmlRpcValue* list = find(key)) {
    if (list->getType() != XmlRpcValue::TypeArray) {
      throwBad(fullKey(key), *list, "a list of texts");
    }
    if (list->size() > 0) {
      record_->given.push_back(key);
    }
    for (int i = 0; i < list->size(); ++i) {
      result.push_back(textFrom(fullKey(element(key, i)), (*list)[i]));
    }
  }
  return result;
}

ParamLoader ParamLoader::child(const std::string& prefix, const XmlRpcValue& tree) const {
  ParamLoader loader(prefix, tree);
  record_->children.push_back(loader);
  return loader;
}

ParamLoader ParamLoader::section(const std::string& key) const {
  const XmlRpcValue* tree = find(key);
  return child(fullKey(key), tree == nullptr ? XmlRpcValue() : *tree);
}

std::vector<ParamLoader> ParamLoader::sections(const std::string& key) const {
  std::vector<ParamLoader> result;
  if (const XmlRpcValue* list = find(key)) {
    if (list->getType() != XmlRpcValue::TypeArray) {
      throwBad(fullKey(key), *list, "a list of maps");
    }
    for (int i = 0; i < list->size(); ++i) {
      result.push_back(child(fullKey(element(key, i)), (*list)[i]));
    }
  }
  return result;
}

std::vector<std::pair<std::string, ParamLoader>> ParamLoader::namedSections() const {
  std::vector<std::pair<std::string, ParamLoader>> result;
  if (tree_.valid()) {
    for (const auto& member : tree_) {
      result.emplace_back(member.first, section(member.first));
    }
  }
  return result;
}

std::vector<std::pair<std::string, double>> ParamLoader::namedNumbers(Range<double> range) const {
  std::vector<std::pair<std::string, double>> result;
  if (tree_.valid()) {
    for (const auto& member : tree_) {
      result.emplace_back(member.first, number(member.first, range));
    }
  }
  return result;
}

std::vector<std::string> ParamLoader::given() const {
  std::vector<std::string> texts;
  collectGiven(fullKey("").size(), &texts);
  return texts;
}

void ParamLoader::collectGiven(std::size_t skipped, std::vector<std::string>* texts) const {
  for (const std::string& key : record_->given) {
    texts->push_back(fullKey(key).substr(skipped) + ": " + (isSecret(key) ? kSecret : showAll(tree_[key])));
  }
  for (const ParamLoader& child : record_->children) {
    child.collectGiven(skipped, texts);
  }
}

XmlRpcValue ParamLoader::known() const {
  XmlRpcValue out;
  for (const std::string& key : record_->known) {
    if (tree_.valid() && tree_.hasMember(key)) out[key] = tree_[key];
  }
  return out;
}

XmlRpcValue ParamLoader::asRead(const XmlRpcValue& later) const {
  XmlRpcValue out = known();
  if (later.getType() != XmlRpcValue::TypeStruct) return out;
  for (const auto& [key, value] : later) {
    if (record_->known.count(key) == 0) out[key] = value;
  }
  return out;
}

void ParamLoader::allow(const std::string& key) const { record_->known.insert(key); }

void ParamLoader::refuse(const std::string& key, const std::string& requirement) const {
  throwBad(fullKey(key), require(key), requirement);
}

void ParamLoader::collectUnknown(bool only_misspelt, std::vector<std::string>* problems) const {
  if (tree_.valid()) {
    const std::vector<std::string> known(record_->known.begin(), record_->known.end());
    for (const auto& member : tree_) {
      if (record_->known.count(member.first) != 0) {
        continue;
      }
      const std::string nearest = nearestWord(member.first, known);
      if (!nearest.empty()) {
        if (!only_misspelt || member.second.getType() != XmlRpcValue::TypeStruct) {
          problems->push_back(fullKey(member.first) + " (did you mean " + nearest + "?)");
        }
      } else if (!only_misspelt) {
        problems->push_back(fullKey(member.first) + " (known here: " + core::join(known) + ")");
      }
    }
  }
  for (const ParamLoader& child : record_->children) {
    child.collectUnknown(only_misspelt, problems);
  }
}

void ParamLoader::refuseUnknown() const { throwUnknown(false); }

void ParamLoader::refuseMisspelt() const { throwUnknown(true); }

void ParamLoader::throwUnknown(bool only_misspelt) const {
  std::vector<std::string> problems;
  collectUnknown(only_misspelt, &problems);
  if (!problems.empty()) {
    throw ParamError("unknown parameter" + std::string(problems.size() > 1 ? "s " : " ") + core::join(problems, "; ") +
                     "; correct the name in the YAML or launch file, or remove a left-over with: rosparam delete KEY");
  }
}

std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t fewest = std::string::npos;
  for (const std::string& candidate : candidates) {
    const size_t edits = editDistance(word, candidate);
    if (edits < fewest && 3 * edits <= std::max(word.size(), candidate.size())) {
      fewest = edits;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace xplane_bridge
