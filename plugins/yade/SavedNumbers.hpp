// Numbers as text of which every archive of YADE keeps all bits, XML too.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace yade::dembark_yade {

/// Numbers in hexadecimal.
inline std::string encode(const std::vector<double>& numbers) {
	std::string text;
	char        number[40];
	for (const double x : numbers) text.append(number, std::snprintf(number, sizeof number, "%a ", x));
	return text;
}

inline std::vector<double> decode(const std::string& text) {
	std::vector<double> numbers;
	char*               next = nullptr;
	for (const char* at = text.c_str(); *at; at = *next ? next + 1 : next) numbers.push_back(std::strtod(at, &next));
	return numbers;
}

}  // namespace yade::dembark_yade
