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
  std::string comment;  ///< of the field's line
};

/// Values of the fields by name; a time is one value in seconds, an array or vector several.
using MessageValues = std::map<std::string, std::vector<double>>;

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
  MessageValues read(const Message& message) const {
    std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
    ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::serialize(out, message);
    MessageValues values;
    std::size_t at = 0;
    for (const MessageLeaf& leaf : leaves_) {
      if (leaf.type == "string") {
        at += sizeof(std::uint32_t) + take<std::uint32_t>(bytes, at);
      } else {
        values[leaf.field].push_back(takeNumber(leaf.type, bytes, at));
        at += sizeOf(leaf.type);
      }
    }
    if (at != bytes.size()) throw std::logic_error("the definition and the serialised message differ in length");
    return values;
  }

  /// A message with these values; strings are empty. Every field must be given.
  template <class Message>
  Message make(const MessageValues& values) const {
    std::vector<std::uint8_t> bytes;
    std::map<std::string, std::size_t> next;
    for (const MessageLeaf& leaf : leaves_) {
      if (leaf.type == "string") {
        put<std::uint32_t>(0, bytes);
      } else {
        putNumber(leaf.type, values.at(leaf.field).at(next[leaf.field]++), bytes);
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
      const std::size_t bracket = type.find('[');
      if (bracket != std::string::npos) {
        count = std::stoul(type.substr(bracket + 1));
        type = type.substr(0, bracket);
      }
      // The parts of a header are fields of their own, those of a vector belong to the vector.
      const bool header = field == "header";
      const std::string full = field.empty() ? name : header ? "header." + name : field;
      for (std::size_t i = 0; i < count; ++i) {
        const std::string nested = type.substr(type.rfind('/') + 1);
        if (sections_.count(nested) != 0) {
          flatten(nested, full, field.empty() ? own : comment);
        } else {
          leaves_.push_back({full, type, field.empty() ? own : comment});
        }
      }
    }
  }

  static std::size_t sizeOf(const std::string& type) {
    static const std::map<std::string, std::size_t> sizes = {{"bool", 1},    {"uint8", 1},   {"uint32", 4},
                                                             {"float32", 4}, {"float64", 8}, {"time", 8}};
    return sizes.at(type);
  }

  template <typename T>
  static T take(const std::vector<std::uint8_t>& bytes, std::size_t at) {
    T value;
    std::memcpy(&value, &bytes.at(at), sizeof value);
    return value;
  }
  static double takeNumber(const std::string& type, const std::vector<std::uint8_t>& bytes, std::size_t at) {
    if (type == "float32") return static_cast<double>(take<float>(bytes, at));
    if (type == "float64") return take<double>(bytes, at);
    if (type == "uint32") return take<std::uint32_t>(bytes, at);
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
    } else if (type == "uint32") {
      put(static_cast<std::uint32_t>(value), bytes);
    } else if (type == "time") {
      const double whole = std::floor(value);
      put(static_cast<std::uint32_t>(whole), bytes);
      put(static_cast<std::uint32_t>(std::lround((value - whole) * 1e9)), bytes);
    } else {
      put(static_cast<std::uint8_t>(value), bytes);
    }
  }

  std::map<std::string, std::vector<std::string>> sections_;
  std::vector<MessageLeaf> leaves_;
};

}  // namespace xplane_bridge
