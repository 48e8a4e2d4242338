// A plain program on Fast DDS, which ROS 2 uses by default and which shares no code with Cyclone DDS: what others' nodes
// get from ours and give to them.
//
// Its types are written by hand from ROS 2's definitions and encoded by Fast CDR. It joins the domain that it is given,
// with the sizes of buffers that Fast DDS has by default, on loopback only. It reads orders as lines of words and answers
// each by one line of JSON:
//
//   listen TOPIC TYPE reliable|best_effort     begins to note messages
//   get TOPIC                                  the messages so far; of images the number of bytes and whether these are right
//   advertise TOPIC TYPE reliable|best_effort
//   matched TOPIC                              how many are connected
//   publish TOPIC COUNT PERIOD_MS VALUES...    sends COUNT messages: a text, six numbers, or a size in bytes

#include <chrono>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

struct Message {
    virtual ~Message() = default;
    virtual void code(Cdr& cdr, bool out) = 0;
    virtual size_t size() const = 0;
    virtual void set(std::istream& words) = 0;
    virtual std::string json() const = 0;

    template <class Value>
    static void pass(Cdr& cdr, bool out, Value& value) {
        out ? cdr.serialize(value) : cdr.deserialize(value);
    }
};

struct String : Message {
    static constexpr const char* dds_name = "std_msgs::msg::dds_::String_";
    std::string data;

    void code(Cdr& cdr, bool out) override { pass(cdr, out, data); }
    size_t size() const override { return 8 + data.size(); }
    void set(std::istream& words) override { std::getline(words >> std::ws, data); }
    std::string json() const override { return '"' + data + '"'; }
};

struct Twist : Message {
    static constexpr const char* dds_name = "geometry_msgs::msg::dds_::Twist_";
    double values[6] = {};

    void code(Cdr& cdr, bool out) override {
        for (double& value : values) pass(cdr, out, value);
    }
    size_t size() const override { return sizeof values; }
    void set(std::istream& words) override {
        for (double& value : values) words >> value;
    }
    std::string json() const override {
        std::ostringstream text;
        text.precision(17);
        for (double value : values) text << (text.tellp() > 0 ? ", " : "[") << value;
        return text.str() + "]";
    }
};

struct Picture : Message {
    int32_t sec = 0;
    uint32_t nanosec = 0;
    std::string frame_id = "camera";
    std::vector<uint8_t> data;

    void header(Cdr& cdr, bool out) {
        pass(cdr, out, sec);
        pass(cdr, out, nanosec);
        pass(cdr, out, frame_id);
    }
    size_t size() const override { return 256 + data.size(); }
    void set(std::istream& words) override {
        size_t bytes = 0;
        words >> bytes;
        data.resize(bytes);
        for (size_t at = 0; at < bytes; ++at) data[at] = static_cast<uint8_t>(at * 7);
    }
    // The sender's picture holds the same pattern, so that a byte that is missing or moved is seen.
    std::string json() const override {
        bool right = true;
        for (size_t at = 0; at < data.size() && right; ++at) right = data[at] == static_cast<uint8_t>(at * 7);
        return "[" + std::to_string(data.size()) + (right ? ", true]" : ", false]");
    }
};

struct CompressedImage : Picture {
    static constexpr const char* dds_name = "sensor_msgs::msg::dds_::CompressedImage_";
    std::string format = "jpeg";

    void code(Cdr& cdr, bool out) override {
        header(cdr, out);
        pass(cdr, out, format);
        pass(cdr, out, data);
    }
};

struct Image : Picture {
    static constexpr const char* dds_name = "sensor_msgs::msg::dds_::Image_";
    uint32_t height = 480, width = 640, step = 1920;
    std::string encoding = "bgr8";
    uint8_t is_bigendian = 0;

    void code(Cdr& cdr, bool out) override {
        header(cdr, out);
        pass(cdr, out, height);
        pass(cdr, out, width);
        pass(cdr, out, encoding);
        pass(cdr, out, is_bigendian);
        pass(cdr, out, step);
        pass(cdr, out, data);
    }
};

template <class Kind>
class Type : public TopicDataType {
public:
    Type() {
        setName(Kind::dds_name);
        m_typeSize = 256;  // grows with what is sent
        m_isGetKeyDefined = false;
    }

    bool serialize(void* data, SerializedPayload_t* payload) override {
        eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
        Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        payload->encapsulation = cdr.endianness() == Cdr::BIG_ENDIANNESS ? CDR_BE : CDR_LE;
        cdr.serialize_encapsulation();
        static_cast<Message*>(data)->code(cdr, true);
        payload->length = static_cast<uint32_t>(cdr.getSerializedDataLength());
        return true;
    }

    bool deserialize(SerializedPayload_t* payload, void* data) override {
        eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
        Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        try {
            cdr.read_encapsulation();
            static_cast<Message*>(data)->code(cdr, false);
        } catch (const eprosima::fastcdr::exception::Exception& problem) {
            std::cerr << "cannot be read: " << problem.what() << std::endl;
            return false;
        }
        return true;
    }

    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Message*>(data)->size()) + 4; };
    }

    void* createData() override { return static_cast<Message*>(new Kind()); }
    void deleteData(void* data) override { delete static_cast<Message*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

TypeSupport type_of(const std::string& name) {
    if (name == "String") return TypeSupport(new Type<String>());
    if (name == "Twist") return TypeSupport(new Type<Twist>());
    if (name == "CompressedImage") return TypeSupport(new Type<CompressedImage>());
    return TypeSupport(new Type<Image>());
}

class Notes : public DataReaderListener {
public:
    void on_data_available(DataReader* reader) override {
        TypeSupport type = type_of_;
        std::unique_ptr<Message> message(static_cast<Message*>(type.create_data()));
        SampleInfo info;
        while (reader->take_next_sample(message.get(), &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            std::lock_guard<std::mutex> hold(mutex_);
            notes_ += (notes_.empty() ? "" : ", ") + message->json();
        }
    }
    explicit Notes(TypeSupport type) : type_of_(type) {}
    std::string json() {
        std::lock_guard<std::mutex> hold(mutex_);
        return "[" + notes_ + "]";
    }

private:
    TypeSupport type_of_;
    std::mutex mutex_;
    std::string notes_;
};

class Peer {
public:
    explicit Peer(uint32_t domain) {
        DomainParticipantQos qos;
        auto loopback = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        loopback->interfaceWhiteList.emplace_back("127.0.0.1");
        qos.transport().use_builtin_transports = false;
        loopback->maxInitialPeersRange = 32;
        qos.transport().user_transports.push_back(loopback);
        eprosima::fastrtps::rtps::Locator_t here;
        eprosima::fastrtps::rtps::IPLocator::setIPv4(here, "127.0.0.1");
        qos.wire_protocol().builtin.initialPeersList.push_back(here);
        participant_ = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
        if (!participant_) throw std::runtime_error("cannot join the domain");
        publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
        subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    }

    std::string answer(const std::string& line) {
        std::istringstream words(line);
        std::string order, topic;
        words >> order >> topic;
        if (order == "listen") return listen(topic, words);
        if (order == "advertise") return advertise(topic, words);
        if (order == "publish") return publish(topic, words);
        if (order == "matched") return std::to_string(matched(topic));
        if (order == "get") return notes_.at(topic)->json();
        throw std::runtime_error("no such order: " + line);
    }

private:
    Topic* topic(const std::string& name, TypeSupport type) {
        type.register_type(participant_);
        return participant_->create_topic("rt" + name, type.get_type_name(), TOPIC_QOS_DEFAULT);
    }

    template <class Qos>
    static Qos profile(Qos qos, const std::string& reliability) {
        qos.reliability().kind = reliability == "reliable" ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
        qos.durability().kind = VOLATILE_DURABILITY_QOS;
        qos.history().kind = KEEP_LAST_HISTORY_QOS;
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        return qos;
    }

    std::string listen(const std::string& name, std::istream& words) {
        std::string kind, reliability;
        words >> kind >> reliability;
        TypeSupport type = type_of(kind);
        notes_[name] = std::make_unique<Notes>(type);
        readers_[name] = subscriber_->create_datareader(
            topic(name, type), profile(DATAREADER_QOS_DEFAULT, reliability), notes_[name].get());
        return readers_[name] ? "true" : "false";
    }

    std::string advertise(const std::string& name, std::istream& words) {
        std::string kind, reliability;
        words >> kind >> reliability;
        types_[name] = type_of(kind);
        writers_[name] =
            publisher_->create_datawriter(topic(name, types_[name]), profile(DATAWRITER_QOS_DEFAULT, reliability));
        return writers_[name] ? "true" : "false";
    }

    std::string publish(const std::string& name, std::istream& words) {
        int count = 0, period_ms = 0;
        words >> count >> period_ms;
        std::unique_ptr<Message> message(static_cast<Message*>(types_[name].create_data()));
        message->set(words);
        for (auto due = std::chrono::steady_clock::now(); count-- > 0; std::this_thread::sleep_until(due)) {
            writers_.at(name)->write(message.get());
            due += std::chrono::milliseconds(period_ms);
        }
        return "true";
    }

    int matched(const std::string& name) {
        if (writers_.count(name)) {
            PublicationMatchedStatus status;
            writers_[name]->get_publication_matched_status(status);
            return status.current_count;
        }
        SubscriptionMatchedStatus status;
        readers_.at(name)->get_subscription_matched_status(status);
        return status.current_count;
    }

    DomainParticipant* participant_;
    Publisher* publisher_;
    Subscriber* subscriber_;
    std::map<std::string, std::unique_ptr<Notes>> notes_;
    std::map<std::string, TypeSupport> types_;
    std::map<std::string, DataReader*> readers_;
    std::map<std::string, DataWriter*> writers_;
};

int main(int, char** arguments) {
    Peer peer(static_cast<uint32_t>(std::stoul(arguments[1])));
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line);) std::cout << peer.answer(line) << std::endl;
    std::_Exit(0);
}
