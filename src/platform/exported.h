// SPDX-License-Identifier: Apache-2.0
// EWA_EXPORTED marks what a shared library of ewa shows to the program that loads it.
#pragma once
#ifdef _WIN32
#define EWA_EXPORTED __declspec(dllexport)
#else
#define EWA_EXPORTED __attribute__((visibility("default")))
#endif
