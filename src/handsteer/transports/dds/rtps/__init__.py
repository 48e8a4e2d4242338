"""As much of RTPS, the wire of DDS, as it takes to answer service clients on Fast DDS.

Who asks, and whom a reply is for, stands there in the headers of RTPS, which Cyclone DDS neither shows nor sends. All
numbers of parameters, entities and submessages are from OMG DDSI-RTPS 2.5, those of services from DDS-RPC 1.0, and
from Fast DDS where it has others. Identifiers (GUIDs) are 16 bytes: 12 of the participant, its *prefix*, and 4 of the
entity.
"""
