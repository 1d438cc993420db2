#pragma once

#include <cstddef>

/// Allocations of the whole program since its start, for tests of "no allocation in steady state". The counting
/// operators are in a file of their own, where the compiler does not inline them into callers.
std::size_t allocationCount();
