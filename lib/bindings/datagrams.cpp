// What the emulator sends in a frame, in one call of the kernel: a call for each datagram is most of a frame's time.
// Only Linux has that call; elsewhere the emulator sends one by one.

#include "xplane_bridge/bindings/python_object.hpp"

#ifdef __linux__

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <vector>

namespace xplane_bridge::bindings {
namespace {

sockaddr_in address(PyObject* target) {
  const char* host = nullptr;
  unsigned short port = 0;
  if (!PyArg_ParseTuple(target, "sH", &host, &port)) throw PythonError{};
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(port);
  if (inet_pton(AF_INET, host, &out.sin_addr) != 1) {
    raise(PyExc_ValueError, std::string("'") + host + "': expected an IPv4 address in numbers");
  }
  return out;
}

/// Sends as many as go, in their order. Returns how many the kernel has refused.
int sendAll(int fd, std::vector<mmsghdr>* messages) {
  int refused = 0;
  for (std::size_t sent = 0; sent < messages->size();) {
    const int count = sendmmsg(fd, messages->data() + sent, static_cast<unsigned>(messages->size() - sent), 0);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
    } else if (errno != EINTR) {
      ++refused;
      ++sent;
    }
  }
  return refused;
}

PyObject* sendDatagrams(PyObject* /*module*/, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    int fd = -1;
    PyObject* given = nullptr;
    if (!PyArg_ParseTuple(arguments, "iO", &fd, &given)) throw PythonError{};
    const std::vector<Object> datagrams = items(given);
    std::vector<sockaddr_in> targets(datagrams.size());
    std::vector<iovec> contents(datagrams.size());
    std::vector<mmsghdr> messages(datagrams.size());
    for (std::size_t i = 0; i < datagrams.size(); ++i) {
      PyObject *bytes = nullptr, *target = nullptr;
      if (!PyArg_ParseTuple(datagrams[i].get(), "SO!", &bytes, &PyTuple_Type, &target)) throw PythonError{};
      targets[i] = address(target);
      contents[i] = {PyBytes_AS_STRING(bytes), static_cast<std::size_t>(PyBytes_GET_SIZE(bytes))};
      msghdr& message = messages[i].msg_hdr;
      message.msg_name = &targets[i];
      message.msg_namelen = sizeof(sockaddr_in);
      message.msg_iov = &contents[i];
      message.msg_iovlen = 1;
    }
    return Object(PyLong_FromLong(sendAll(fd, &messages))).release();
  });
}

PyMethodDef functions[] = {
    {"send_datagrams", sendDatagrams, METH_VARARGS,
     "send_datagrams(fd, datagrams) -> refused: sends (bytes, (host, port)) of a list over a UDP socket, in their "
     "order. Returns how many the kernel has refused."},
    {nullptr, nullptr, 0, nullptr},
};

}  // namespace

void addDatagrams(PyObject* module) { check(PyModule_AddFunctions(module, functions)); }

}  // namespace xplane_bridge::bindings

#else

namespace xplane_bridge::bindings {

void addDatagrams(PyObject* /*module*/) {}

}  // namespace xplane_bridge::bindings

#endif
