// Saved scenes of other versions. Boost stores the attributes of a class in their order, without saying which they are: of a scene from
// before an attribute was added it finds out late, by a tag that is not there, or not at all.
#pragma once

#include <stdexcept>
#include <string>

#include <boost/serialization/serialization.hpp>
#include <boost/serialization/version.hpp>

/// At global scope, after the class: saved scenes hold yade::Class in format `number`, to be counted up when its attributes change; those
/// of another format end with one line.
#define DEMBARK_SAVED_FORMAT(Class, number)                                                                           \
	BOOST_CLASS_VERSION(yade::Class, number)                                                                      \
	namespace boost::serialization {                                                                              \
	template <class Archive>                                                                                      \
	void serialize(Archive& archive, yade::Class& object, const unsigned int format) {                            \
		if (Archive::is_loading::value && format != number)                                                   \
			throw std::runtime_error("the scene was saved with another version of dembark, whose " #Class \
			                         " has other attributes (format " +                                   \
			                         std::to_string(format) + ", not " + std::to_string(number) +         \
			                         "); set it up anew, or go on with the version that saved it");       \
		access::serialize(archive, object, format);                                                           \
	}                                                                                                             \
	}
