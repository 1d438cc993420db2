#pragma once

#include <string>

#include <xmlrpcpp/XmlRpcValue.h>

namespace xplane_bridge {

/// A value of the parameter server as JSON on one line, keys sorted: equal values give equal texts. What JSON cannot
/// say (NaN, dates, binary) is null.
std::string parameterText(const XmlRpc::XmlRpcValue& value);

/// Takes out of the parameters of a namespace what is of one computer and one start: its addresses and ports, and of
/// the paths of files and folders that exist all but the last part.
XmlRpc::XmlRpcValue withoutMachine(const XmlRpc::XmlRpcValue& parameters);

/// What stands for a secret in recordings, logs and messages.
constexpr const char* kSecret = "...";
/// Whether the values of a parameter of this name (without its namespace) are known to those alone who share them.
bool isSecret(const std::string& key);
/// Parameters with kSecret for each secret in them that is set.
XmlRpc::XmlRpcValue withoutSecrets(const XmlRpc::XmlRpcValue& parameters);

}  // namespace xplane_bridge
