#pragma once

#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <xmlrpcpp/XmlRpcValue.h>

namespace xplane_bridge {

/// A parameter is missing, of the wrong type, out of range or unknown. `what()` is one line a user can act on: full
/// key, the value given, what is allowed, what to do.
class ParamError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Closed interval of allowed numbers; the default allows every finite number.
template <typename T>
struct Range {
  T lowest = std::numeric_limits<T>::lowest();
  T highest = std::numeric_limits<T>::max();
};

/// Reads one namespace of the parameter server into plain values, strictly.
///
/// A missing key takes the default given at the call; a call without default throws when the key is missing. A present
/// key of the wrong type, a non-finite or out-of-range number always throws: nothing is silently replaced. An integer
/// is accepted where a double is wanted, never the reverse. Every key asked for counts as known, `refuseUnknown()`
/// then refuses the rest, so a misspelt key cannot be ignored.
///
/// Copies share the record of known keys. Not thread-safe; used during start-up only.
class ParamLoader {
 public:
  /// `prefix` is the full name of the namespace ("/xplane/rx_node"), for messages; `tree` its content: a struct, or an
  /// invalid value when the namespace is empty. @throws ParamError when `tree` is anything else.
  ParamLoader(std::string prefix, const XmlRpc::XmlRpcValue& tree);

  /// The content of `ns` on the parameter server, read in one request.
  static ParamLoader fromServer(const std::string& ns);

  /// Full name of `key`, as a user would give it to rosparam.
  std::string fullKey(const std::string& key) const;

  bool has(const std::string& key) const;

  bool boolean(const std::string& key) const;
  bool boolean(const std::string& key, bool fallback) const;
  int integer(const std::string& key, Range<int> range) const;
  int integer(const std::string& key, Range<int> range, int fallback) const;
  double number(const std::string& key, Range<double> range) const;
  double number(const std::string& key, Range<double> range, double fallback) const;
  std::string text(const std::string& key) const;
  std::string text(const std::string& key, const std::string& fallback) const;
  /// One of `allowed`.
  std::string choice(const std::string& key, const std::vector<std::string>& allowed) const;
  std::string choice(const std::string& key, const std::vector<std::string>& allowed,
                     const std::string& fallback) const;
  /// A list; an absent key gives an empty list.
  std::vector<double> numbers(const std::string& key, Range<double> range) const;
  std::vector<std::string> textList(const std::string& key) const;

  /// A struct below this one; empty (has() is false for all) when absent.
  ParamLoader section(const std::string& key) const;
  /// A list of structs; messages name its elements `key[0]`, `key[1]`, …
  std::vector<ParamLoader> sections(const std::string& key) const;
  /// The structs below this one by name, sorted (a map whose keys the user chooses).
  std::vector<std::pair<std::string, ParamLoader>> namedSections() const;
  /// The numbers below this one by name, sorted (a map whose keys the user chooses).
  std::vector<std::pair<std::string, double>> namedNumbers(Range<double> range) const;

  /// What was read here and in the sections below and is not the default given at the call, in the order of reading:
  /// "port: 49010", "limits/upper: 1.5", values as on the parameter server, secrets hidden.
  std::vector<std::string> given() const;

  /// What is set of the keys that were read so far; a struct, or invalid where there is none of them.
  XmlRpc::XmlRpcValue known() const;
  /// What is set by now, `later`, with the keys that were read so far as they were then: absent where they were.
  XmlRpc::XmlRpcValue asRead(const XmlRpc::XmlRpcValue& later) const;
  /// All that is set; invalid where nothing is.
  const XmlRpc::XmlRpcValue& tree() const { return tree_; }

  /// Marks `key` as known without reading it (read elsewhere, by a library for instance).
  void allow(const std::string& key) const;

  /// Throws a ParamError that says `key` (with the value given) must be `requirement`; for checks that the typed
  /// getters cannot express, such as one key depending on another.
  [[noreturn]] void refuse(const std::string& key, const std::string& requirement) const;

  /// @throws ParamError naming every key here and in the sections read that was not asked for, each with the nearest
  /// known one.
  void refuseUnknown() const;

  /// The milder form for a namespace shared with others: refuses only unknown plain values (no structs, which may be
  /// other nodes' namespaces) that look like a misspelt known key. @throws ParamError
  void refuseMisspelt() const;

 private:
  struct Record {
    std::set<std::string> known;
    std::vector<std::string> given;  // keys
    std::vector<ParamLoader> children;
  };

  const XmlRpc::XmlRpcValue* find(const std::string& key) const;
  const XmlRpc::XmlRpcValue& require(const std::string& key) const;
  const XmlRpc::XmlRpcValue& requireGiven(const std::string& key) const;
  template <typename T, typename Read>
  T readOr(const std::string& key, const T& fallback, const Read& read) const;
  void collectGiven(std::size_t skipped, std::vector<std::string>* texts) const;
  ParamLoader child(const std::string& prefix, const XmlRpc::XmlRpcValue& tree) const;
  void throwUnknown(bool only_misspelt) const;
  void collectUnknown(bool only_misspelt, std::vector<std::string>* problems) const;

  std::string prefix_;
  XmlRpc::XmlRpcValue tree_;
  std::shared_ptr<Record> record_;
};

/// The member of `candidates` that takes the fewest edits (one character inserted, deleted, replaced, or two neighbours
/// swapped) to reach from `word`; empty when none is near enough to be a likely misspelling (more than a third of the
/// longer word).
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace xplane_bridge
