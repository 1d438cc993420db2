#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

/// A ROS message by the names of its fields: walked through in its serialised form, along the definition that ROS
/// itself carries with the type. Knows nothing of the package's generated code.
namespace xplane_bridge {

/// One primitive of a serialised message.
struct MessageLeaf {
  std::string field;  ///< of the top message; the parts of a vector have the same
  std::string type;
  std::string comment;   ///< of the field's line
  bool is_list = false;  ///< as many of them as the message says
};

/// Values of the fields by name; a time is one value in seconds, an array or vector several.
using MessageValues = std::map<std::string, std::vector<double>>;
/// Strings of the fields by name; a list has several.
using MessageTexts = std::map<std::string, std::vector<std::string>>;

struct MessageContent {
  MessageValues values;
  MessageTexts texts;
};

class MessageLayout {
 public:
  template <class Message>
  static MessageLayout of() {
    return MessageLayout(ros::message_traits::Definition<Message>::value());
  }

  explicit MessageLayout(const std::string& definition) {
    std::istringstream lines(definition);
    std::string line, section = "top";
    while (std::getline(lines, line)) {
      if (line.compare(0, 3, "===") == 0) continue;
      if (line.compare(0, 5, "MSG: ") == 0) {
        section = line.substr(line.rfind('/') + 1);
      } else {
        sections_[section].push_back(line);
      }
    }
    flatten("top", "", "");
  }

  const std::vector<MessageLeaf>& leaves() const { return leaves_; }
  std::vector<std::string> fields() const {
    std::vector<std::string> names;
    for (const MessageLeaf& leaf : leaves_) {
      if (names.empty() || names.back() != leaf.field) names.push_back(leaf.field);
    }
    return names;
  }
  const MessageLeaf& leaf(const std::string& field) const {
    for (const MessageLeaf& leaf : leaves_) {
      if (leaf.field == field) return leaf;
    }
    throw std::out_of_range(field);
  }

  template <class Message>
  MessageContent content(const Message& message) const {
    std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
    ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::serialize(out, message);
    MessageContent content;
    std::size_t at = 0;
    for (const MessageLeaf& leaf : leaves_) {
      const bool is_text = leaf.type == "string";
      is_text ? static_cast<void>(content.texts[leaf.field]) : static_cast<void>(content.values[leaf.field]);
      const std::size_t count = leaf.is_list ? takeCount(bytes, &at) : 1;
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t size = is_text ? takeCount(bytes, &at) : sizeOf(leaf.type);
        if (at + size > bytes.size()) throw std::logic_error("the serialised message is shorter than its definition");
        if (is_text) {
          content.texts[leaf.field].emplace_back(bytes.data() + at, bytes.data() + at + size);
        } else {
          content.values[leaf.field].push_back(takeNumber(leaf.type, bytes, at));
        }
        at += size;
      }
    }
    if (at != bytes.size()) throw std::logic_error("the definition and the serialised message differ in length");
    return content;
  }
  template <class Message>
  MessageValues read(const Message& message) const {
    return content(message).values;
  }

  /// A message with these values and texts. Every number must be given; a string that is not given is empty.
  template <class Message>
  Message make(const MessageValues& values, const MessageTexts& texts = {}) const {
    std::vector<std::uint8_t> bytes;
    std::map<std::string, std::size_t> next;
    for (const MessageLeaf& leaf : leaves_) {
      const bool is_text = leaf.type == "string";
      const auto text = texts.find(leaf.field);
      const std::size_t texts_given = text == texts.end() ? 0 : text->second.size();
      std::size_t count = 1;
      if (leaf.is_list) {
        count = is_text ? texts_given : values.at(leaf.field).size();
        put(static_cast<std::uint32_t>(count), bytes);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t part = next[leaf.field]++;
        if (is_text) {
          putText(part < texts_given ? text->second[part] : "", bytes);
        } else {
          putNumber(leaf.type, values.at(leaf.field).at(part), bytes);
        }
      }
    }
    Message message;
    ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(in, message);
    return message;
  }

 private:
  void flatten(const std::string& section, const std::string& field, const std::string& comment) {
    for (const std::string& line : sections_.at(section)) {
      const std::string code = line.substr(0, line.find('#'));
      std::istringstream words(code);
      std::string type, name;
      if (!(words >> type >> name) || code.find('=') != std::string::npos) continue;
      const std::size_t hash = line.find('#');
      const std::string own = hash == std::string::npos ? "" : line.substr(std::min(hash + 2, line.size()));
      std::size_t count = 1;
      bool is_list = false;
      const std::size_t bracket = type.find('[');
      if (bracket != std::string::npos) {
        is_list = type.substr(bracket) == "[]";
        if (!is_list) count = std::stoul(type.substr(bracket + 1));
        type = type.substr(0, bracket);
      }
      // The parts of a header are fields of their own, those of a vector belong to the vector.
      const bool header = field == "header";
      const std::string full = field.empty() ? name : header ? "header." + name : field;
      for (std::size_t i = 0; i < count; ++i) {
        const std::string nested = type.substr(type.rfind('/') + 1);
        if (sections_.count(nested) != 0) {
          if (is_list)
            throw std::logic_error(full + " is a list of messages, which MessageLayout does not walk through");
          flatten(nested, full, field.empty() ? own : comment);
        } else {
          leaves_.push_back({full, type, field.empty() ? own : comment, is_list});
        }
      }
    }
  }

  static std::size_t sizeOf(const std::string& type) {
    static const std::map<std::string, std::size_t> sizes = {{"bool", 1},    {"uint8", 1}, {"uint16", 2},
                                                             {"uint32", 4},  {"int32", 4}, {"float32", 4},
                                                             {"float64", 8}, {"time", 8},  {"duration", 8}};
    return sizes.at(type);
  }

  template <typename T>
  static T take(const std::vector<std::uint8_t>& bytes, std::size_t at) {
    T value;
    std::memcpy(&value, &bytes.at(at), sizeof value);
    return value;
  }
  static std::size_t takeCount(const std::vector<std::uint8_t>& bytes, std::size_t* at) {
    const auto count = take<std::uint32_t>(bytes, *at);
    *at += sizeof count;
    return count;
  }
  static double takeNumber(const std::string& type, const std::vector<std::uint8_t>& bytes, std::size_t at) {
    if (type == "float32") return static_cast<double>(take<float>(bytes, at));
    if (type == "float64") return take<double>(bytes, at);
    if (type == "uint16") return take<std::uint16_t>(bytes, at);
    if (type == "uint32") return take<std::uint32_t>(bytes, at);
    if (type == "int32") return take<std::int32_t>(bytes, at);
    if (type == "duration") return take<std::int32_t>(bytes, at) + 1e-9 * take<std::int32_t>(bytes, at + 4);
    if (type == "time") return take<std::uint32_t>(bytes, at) + 1e-9 * take<std::uint32_t>(bytes, at + 4);
    return bytes.at(at);
  }

  template <typename T>
  static void put(T value, std::vector<std::uint8_t>& bytes) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  }
  static void putNumber(const std::string& type, double value, std::vector<std::uint8_t>& bytes) {
    if (type == "float32") {
      put(static_cast<float>(value), bytes);
    } else if (type == "float64") {
      put(value, bytes);
    } else if (type == "uint16") {
      put(static_cast<std::uint16_t>(value), bytes);
    } else if (type == "uint32") {
      put(static_cast<std::uint32_t>(value), bytes);
    } else if (type == "int32") {
      put(static_cast<std::int32_t>(value), bytes);
    } else if (type == "time") {
      const double whole = std::floor(value);
      put(static_cast<std::uint32_t>(whole), bytes);
      put(static_cast<std::uint32_t>(std::lround((value - whole) * 1e9)), bytes);
    } else if (type == "bool" || type == "uint8") {
      put(static_cast<std::uint8_t>(value), bytes);
    } else {
      throw std::logic_error("MessageLayout::make does not know the type " + type);
    }
  }
  static void putText(const std::string& text, std::vector<std::uint8_t>& bytes) {
    put(static_cast<std::uint32_t>(text.size()), bytes);
    bytes.insert(bytes.end(), text.begin(), text.end());
  }

  std::map<std::string, std::vector<std::string>> sections_;
  std::vector<MessageLeaf> leaves_;
};

}  // namespace xplane_bridge
