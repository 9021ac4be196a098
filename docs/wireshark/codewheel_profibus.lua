-- PROFIBUS telegrams in Wireshark: one telegram a packet, link type USER0 (147), as codewheel
-- records them.
--
-- For a trial:   tshark -X lua_script:docs/wireshark/codewheel_profibus.lua -r FILE.pcapng
-- To stay:       install -Dt ~/.local/lib/wireshark/plugins docs/wireshark/codewheel_profibus.lua
--
-- It names function codes, services, tokens and short acknowledges of any station (EN 50170-2), and
-- the parameters, configurations, diagnoses and process data of slaves with ident number 059Bh. What
-- belongs to another ident number, or to a slave that has not said its own, is shown as octets.

local proto = Proto("codewheel_profibus", "PROFIBUS-DP")

-- The rows of the device: parameters, configurations, diagnosis. The tests of codewheel-capture hold
-- them to the ones that answer the wire.
-- rows begin
local PARAMETERS = {
  { first = 9, last = 9, bit = 0, name = "Sense of rotation", unit = "", values = { "CW", "CCW" } },
  { first = 9, last = 9, bit = 1, name = "Class 2 functionality", unit = "", values = { "OFF", "ON" } },
  { first = 9, last = 9, bit = 2, name = "Commissioning diagnostics", unit = "", values = { "OFF", "ON" } },
  { first = 9, last = 9, bit = 3, name = "Scaling function", unit = "", values = { "OFF", "ON" } },
  { first = 10, last = 13, name = "Steps per turn", unit = "step", values = {  } },
  { first = 14, last = 17, name = "Total resolution", unit = "step", values = {  } },
}
local CONFIGURATIONS = {
  [0xD1] = "32 bit position",
  [0xF1] = "32 bit position and preset",
  [0xD0] = "16 bit position",
  [0xF0] = "16 bit position and preset",
}
local DIAGNOSIS = {
  { first = 7, last = 7, kind = "unsigned", name = "Extended diagnosis header", unit = "octet" },
  { first = 8, last = 8, kind = "bits", name = "Alarm signals", unit = "", bits = { { 0, "position error or preset out of range" }, } },
  { first = 9, last = 9, kind = "bits", name = "Operating status", unit = "", bits = { { 0, "CCW" }, { 1, "class 2 supported" }, { 3, "scaling on" }, } },
  { first = 10, last = 10, kind = "unsigned", name = "Encoder type", unit = "" },
  { first = 11, last = 14, kind = "unsigned", name = "Singleturn resolution", unit = "step" },
  { first = 15, last = 16, kind = "unsigned", name = "Max. number of revolutions", unit = "" },
  { first = 17, last = 17, kind = "bits", name = "Additional alarm signals", unit = "", bits = { } },
  { first = 18, last = 19, kind = "bits", name = "Supported alarm signals", unit = "", bits = { { 0, "position error or preset out of range" }, } },
  { first = 20, last = 21, kind = "bits", name = "Warnings", unit = "", bits = { { 5, "lithium cell voltage too low" }, } },
  { first = 22, last = 23, kind = "bits", name = "Supported warning signals", unit = "", bits = { { 5, "lithium cell voltage too low" }, } },
  { first = 24, last = 25, kind = "version", name = "Profile version", unit = "" },
  { first = 26, last = 27, kind = "version", name = "Software version", unit = "" },
  { first = 28, last = 31, kind = "unsigned", name = "Hours-run counter", unit = "" },
  { first = 32, last = 35, kind = "signed", name = "Offset value", unit = "step" },
  { first = 36, last = 39, kind = "signed", name = "Manufacturer offset", unit = "step" },
  { first = 40, last = 43, kind = "unsigned", name = "Steps per revolution", unit = "step" },
  { first = 44, last = 47, kind = "unsigned", name = "Total resolution in steps", unit = "step" },
  { first = 48, last = 57, kind = "text", name = "Serial number", unit = "" },
}
-- rows end

local IDENT_NUMBER = 0x059B

local FUNCTIONS = {
  [0x3] = "SDA_low", [0x4] = "SDN_low", [0x5] = "SDA_high", [0x6] = "SDN_high",
  [0x9] = "FDL status", [0xC] = "SRD_low", [0xD] = "SRD_high", [0xE] = "ident",
  [0xF] = "LSAP status",
}
local REPLIES = {
  [0x0] = "OK", [0x1] = "UE", [0x2] = "RR", [0x3] = "RS", [0x8] = "DL", [0x9] = "NR",
  [0xA] = "DH", [0xC] = "RDL", [0xD] = "RDH",
}
local STATIONS = {
  [0] = "slave", [1] = "master, not ready", [2] = "master, ready", [3] = "master, in the ring",
}
local SERVICES = {
  [55] = "Set_Slave_Add", [56] = "RD_Inp", [57] = "RD_Outp", [58] = "Global_Control",
  [59] = "Get_Cfg", [60] = "Slave_Diag", [61] = "Set_Prm", [62] = "Chk_Cfg",
}
local DATA_EXCHANGE = "Data_Exchange"
local STATION_STATUS = {
  { 3, "WD_On" }, { 4, "Freeze_Req" }, { 5, "Sync_Req" }, { 6, "Unlock_Req" }, { 7, "Lock_Req" },
}
local OCTET_8 = {
  { 2, "WD_Base_1ms" }, { 5, "Publisher_Enable" }, { 6, "Fail_Safe" }, { 7, "DPV1_Enable" },
}
local COMMANDS = {
  { 1, "Clear_Data" }, { 2, "Unfreeze" }, { 3, "Freeze" }, { 4, "Unsync" }, { 5, "Sync" },
}
local STATUS = {
  {
    { 0, "Station_Non_Existent" }, { 1, "Station_Not_Ready" }, { 2, "Cfg_Fault" },
    { 3, "Ext_Diag" }, { 4, "Not_Supported" }, { 5, "Invalid_Slave_Response" },
    { 6, "Prm_Fault" }, { 7, "Master_Lock" },
  },
  {
    { 0, "Prm_Req" }, { 1, "Stat_Diag" }, { 3, "WD_On" }, { 4, "Freeze_Mode" },
    { 5, "Sync_Mode" }, { 7, "Deactivated" },
  },
  { { 7, "Ext_Diag_Overflow" } },
}

local f = {
  format = ProtoField.string("codewheel_profibus.format", "Format"),
  da = ProtoField.uint8("codewheel_profibus.da", "Destination"),
  sa = ProtoField.uint8("codewheel_profibus.sa", "Source"),
  fc = ProtoField.uint8("codewheel_profibus.fc", "Function code", base.HEX),
  fc_name = ProtoField.string("codewheel_profibus.function", "Function"),
  fcb = ProtoField.bool("codewheel_profibus.fcb", "FCB", 8, nil, 0x20),
  fcv = ProtoField.bool("codewheel_profibus.fcv", "FCV", 8, nil, 0x10),
  station = ProtoField.string("codewheel_profibus.station", "Station type"),
  dsap = ProtoField.uint8("codewheel_profibus.dsap", "DSAP"),
  ssap = ProtoField.uint8("codewheel_profibus.ssap", "SSAP"),
  service = ProtoField.string("codewheel_profibus.service", "Service"),
  fcs = ProtoField.uint8("codewheel_profibus.fcs", "FCS", base.HEX),
  data = ProtoField.bytes("codewheel_profibus.data", "Data"),
  ident = ProtoField.uint16("codewheel_profibus.ident", "Ident number", base.HEX),
  master = ProtoField.uint8("codewheel_profibus.master", "Master"),
  watchdog = ProtoField.uint32("codewheel_profibus.watchdog", "T_WD in ms"),
  delay = ProtoField.uint8("codewheel_profibus.min_tsdr", "min T_SDR in bits"),
  group = ProtoField.uint8("codewheel_profibus.group", "Group", base.HEX),
  identifier = ProtoField.uint8("codewheel_profibus.identifier", "Identifier", base.HEX),
  flag = ProtoField.string("codewheel_profibus.flag", "Set"),
  value = ProtoField.string("codewheel_profibus.value", "Value"),
  position = ProtoField.uint32("codewheel_profibus.position", "Position"),
  preset = ProtoField.uint32("codewheel_profibus.preset", "Preset"),
  clock = ProtoField.bool("codewheel_profibus.clock", "Clock"),
}
proto.fields = f

local broken = ProtoExpert.new(
  "codewheel_profibus.broken", "No telegram", expert.group.MALFORMED, expert.severity.WARN)
proto.experts = { broken }

-- What answers do not repeat. Packets are looked at in their order once, afterwards in any: what the
-- first pass has learnt of a packet is kept with its number.
local seen, asked, idents
function proto.init()
  seen, asked, idents = {}, nil, {}
end

local function bit_is_set(value, bit)
  return math.floor(value / 2 ^ bit) % 2 == 1
end

-- The names of the bits that are set, those without a name as `bit 3`.
local function bits(value, names)
  local set, known = {}, {}
  for _, name in ipairs(names) do known[name[1]] = name[2] end
  for bit = 0, 31 do
    if bit_is_set(value, bit) then set[#set + 1] = known[bit] or ("bit " .. bit) end
  end
  return set
end

local function add_bits(tree, name, range, value, names)
  local set = bits(value, names)
  local node = tree:add(range, name .. ": " .. (#set == 0 and "none" or table.concat(set, ", ")))
  for _, flag in ipairs(set) do node:add(f.flag, range, flag) end
end

local function add_ident(tree, range, address, state)
  tree:add(f.ident, range)
  state.ident = range:uint()
  if not state.visited then idents[address] = state.ident end
end

local function set_prm(tree, data, address, state)
  if data:len() < 7 then return tree:add(f.data, data) end
  local status = data(0, 1):uint()
  add_bits(tree, "Station status", data(0, 1), status, STATION_STATUS)
  if bit_is_set(status, 3) then
    local base = data:len() > 7 and bit_is_set(data(7, 1):uint(), 2) and 1 or 10
    tree:add(f.watchdog, data(1, 2), data(1, 1):uint() * data(2, 1):uint() * base)
  end
  tree:add(f.delay, data(3, 1))
  add_ident(tree, data(4, 2), address, state)
  tree:add(f.group, data(6, 1))
  if data:len() == 7 then return end
  if state.ident ~= IDENT_NUMBER then return tree:add(f.data, data(7)) end
  add_bits(tree, "Octet 8", data(7, 1), data(7, 1):uint(), OCTET_8)
  for _, row in ipairs(PARAMETERS) do
    if data:len() >= row.last then
      local range = data(row.first - 1, row.last - row.first + 1)
      local value = range:uint()
      if row.bit then value = bit_is_set(value, row.bit) and 1 or 0 end
      local text = row.values[value + 1] or (value .. (row.unit ~= "" and " " .. row.unit or ""))
      tree:add(f.value, range, row.name .. ": " .. text):set_text(row.name .. ": " .. text)
    end
  end
  if data:len() > 17 then tree:add(f.data, data(17)):prepend_text("Reserved: ") end
end

local function slave_diag(tree, data, address, state)
  if data:len() < 6 then return tree:add(f.data, data) end
  for octet = 1, 3 do
    local value = data(octet - 1, 1):uint()
    -- Bit 2 of octet 2 is always 1 and says nothing.
    if octet == 2 and bit_is_set(value, 2) then value = value - 4 end
    add_bits(tree, "Station status " .. octet, data(octet - 1, 1), value, STATUS[octet])
  end
  local master = tree:add(f.master, data(3, 1))
  if data(3, 1):uint() == 255 then master:append_text(" (none)") end
  add_ident(tree, data(4, 2), address, state)
  if data:len() == 6 then return end
  if state.ident ~= IDENT_NUMBER then return tree:add(f.data, data(6)) end
  local shown = 6
  for _, row in ipairs(DIAGNOSIS) do
    if data:len() < row.last then break end
    local range = data(row.first - 1, row.last - row.first + 1)
    shown = row.last
    if row.kind == "bits" then
      add_bits(tree, row.name, range, range:uint(), row.bits)
    else
      local text
      if row.kind == "text" then
        text = range:string()
      elseif row.kind == "version" then
        text = string.format("%X.%02X", range(0, 1):uint(), range(1, 1):uint())
      else
        text = tostring(row.kind == "signed" and range:int() or range:uint())
        if row.unit ~= "" then text = text .. " " .. row.unit end
      end
      tree:add(f.value, range, row.name .. ": " .. text):set_text(row.name .. ": " .. text)
    end
  end
  if data:len() > shown then tree:add(f.data, data(shown)) end
end

local function configuration(tree, data, state)
  for place = 0, data:len() - 1 do
    local node = tree:add(f.identifier, data(place, 1))
    local name = CONFIGURATIONS[data(place, 1):uint()]
    if name and data:len() == 1 and state.ident == IDENT_NUMBER then
      node:append_text(" (" .. name .. ")")
    end
  end
end

local function inputs(tree, data, state)
  if state.ident == IDENT_NUMBER and (data:len() == 2 or data:len() == 4) then
    tree:add(f.position, data)
    return " position " .. data:uint()
  end
  tree:add(f.data, data)
end

local function outputs(tree, data, state)
  if state.ident == IDENT_NUMBER and (data:len() == 2 or data:len() == 4) then
    local clock = bit_is_set(data(0, 1):uint(), 7)
    local preset = data:uint() % 2 ^ (8 * data:len() - 1)
    tree:add(f.preset, data, preset)
    tree:add(f.clock, data(0, 1), clock)
    return string.format(" preset %d clock %d", preset, clock and 1 or 0)
  end
  tree:add(f.data, data)
end

-- What stands behind the service access points. Gives what the info column shall say of it.
local function service_data(tree, service, is_request, data, address, state)
  if not data then return end
  if service == "Slave_Diag" and not is_request then
    slave_diag(tree, data, address, state)
  elseif service == "Set_Prm" and is_request then
    set_prm(tree, data, address, state)
  elseif service == "Chk_Cfg" or service == "Get_Cfg" then
    configuration(tree, data, state)
  elseif service == "Global_Control" and data:len() >= 2 then
    add_bits(tree, "Command", data(0, 1), data(0, 1):uint(), COMMANDS)
    tree:add(f.group, data(1, 1))
  elseif service == DATA_EXCHANGE then
    return (is_request and outputs or inputs)(tree, data, state)
  elseif service == "RD_Inp" and not is_request then
    return inputs(tree, data, state)
  elseif service == "RD_Outp" and not is_request then
    return outputs(tree, data, state)
  else
    tree:add(f.data, data)
  end
end

-- Where DA begins and where FCS stands, or nothing and what is wrong.
local function frame(buffer)
  local length, start = buffer:len(), buffer(0, 1):uint()
  local first, sum
  if start == 0x10 and length == 6 then
    first, sum = 1, 4
  elseif start == 0xA2 and length == 14 then
    first, sum = 1, 12
  elseif start == 0x68 and length >= 10 then
    local le = buffer(1, 1):uint()
    if le ~= buffer(2, 1):uint() or buffer(3, 1):uint() ~= 0x68 or le + 6 ~= length then
      return nil, "lengths that contradict each other"
    end
    first, sum = 4, length - 2
  else
    return nil, "no start delimiter, or another length"
  end
  local total, octets = 0, buffer:bytes()
  for place = first, sum - 1 do total = total + octets:get_index(place) end
  if total % 256 ~= buffer(sum, 1):uint() then return nil, "a wrong FCS" end
  if buffer(length - 1, 1):uint() ~= 0x16 then return nil, "no end delimiter" end
  return first, sum
end

local FORMATS = { [0x10] = "SD1", [0x68] = "SD2", [0xA2] = "SD3" }

local function garbage(tree, buffer, pinfo, what)
  tree:add(f.data, buffer())
  tree:add_proto_expert_info(broken, "No telegram: " .. what)
  pinfo.cols.info = "no telegram: " .. what
end

local function short_acknowledge(tree, buffer, pinfo, state)
  tree:add(f.format, buffer(), "SC")
  local info = "acknowledge"
  if state.asked then
    tree:add(f.service, buffer(), state.asked.service):set_generated()
    pinfo.cols.src, pinfo.cols.dst = tostring(state.asked.to), tostring(state.asked.from)
    info = info .. " " .. state.asked.service
  end
  pinfo.cols.info = info
end

local function data_telegram(tree, buffer, pinfo, state, first, sum)
  local to, from = buffer(first, 1):uint() % 128, buffer(first + 1, 1):uint() % 128
  local extended = buffer(first, 1):uint() >= 128
  -- Both addresses are extended, or neither.
  local is_half = extended ~= (buffer(first + 1, 1):uint() >= 128)
  local code = buffer(first + 2, 1):uint()
  local is_request = bit_is_set(code, 6)
  local name = (is_request and FUNCTIONS or REPLIES)[code % 16] or "reserved"
  pinfo.cols.src, pinfo.cols.dst = tostring(from), tostring(to)
  tree:add(f.format, buffer(0, 1), FORMATS[buffer(0, 1):uint()])
  tree:add(f.da, buffer(first, 1), to)
  tree:add(f.sa, buffer(first + 1, 1), from)
  local fc = tree:add(f.fc, buffer(first + 2, 1))
  fc:add(f.fc_name, buffer(first + 2, 1), name)
  local info = name
  if is_request then
    fc:add(f.fcb, buffer(first + 2, 1))
    fc:add(f.fcv, buffer(first + 2, 1))
  else
    fc:add(f.station, buffer(first + 2, 1), STATIONS[math.floor(code / 16) % 4])
  end
  local begin, service = first + 3, nil
  is_half = is_half or extended and sum - begin < 2
  if is_half then
    tree:add_proto_expert_info(broken, "Half of an address extension")
  elseif extended then
    local dsap, ssap = buffer(begin, 1):uint(), buffer(begin + 1, 1):uint()
    tree:add(f.dsap, buffer(begin, 1))
    tree:add(f.ssap, buffer(begin + 1, 1))
    local sap = is_request and dsap or ssap
    service = SERVICES[sap] or ("SAP " .. sap)
    begin = begin + 2
  end
  local carries = name:find("^S[RD]") ~= nil
  if is_request then
    if not service and carries and not is_half then service = DATA_EXCHANGE end
    if not state.visited then
      local answered = to ~= 127 and not is_half and FUNCTIONS[code % 16]
        and name:find("^SDN") == nil
      asked = answered and { from = from, to = to, service = service or name } or nil
    end
  elseif not is_half and state.asked and state.asked.to == from and state.asked.from == to then
    service = service or state.asked.service
  end
  local address = is_request and to or from
  if not state.visited then state.ident = idents[address] end
  local data = sum > begin and buffer(begin, sum - begin) or nil
  if service then
    tree:add(f.service, buffer(first, sum - first), service)
    info = info .. " " .. service
    info = info .. (service_data(tree, service, is_request, data, address, state) or "")
  elseif data then
    tree:add(f.data, data)
  end
  tree:add(f.fcs, buffer(sum, 1))
  pinfo.cols.info = info
end

function proto.dissector(buffer, pinfo, root)
  if buffer:len() == 0 then return end
  pinfo.cols.protocol = "PROFIBUS-DP"
  local tree = root:add(proto, buffer())
  local state = seen[pinfo.number]
  if state then
    state.visited = true
  else
    state = { asked = asked }
    seen[pinfo.number] = state
    asked = nil
  end
  local start = buffer(0, 1):uint()
  if start == 0xE5 and buffer:len() == 1 then
    return short_acknowledge(tree, buffer, pinfo, state)
  elseif start == 0xDC and buffer:len() == 3 then
    tree:add(f.format, buffer(0, 1), "SD4")
    tree:add(f.service, buffer(0, 1), "token")
    tree:add(f.da, buffer(1, 1), buffer(1, 1):uint() % 128)
    tree:add(f.sa, buffer(2, 1), buffer(2, 1):uint() % 128)
    pinfo.cols.src = tostring(buffer(2, 1):uint() % 128)
    pinfo.cols.dst = tostring(buffer(1, 1):uint() % 128)
    pinfo.cols.info = "token"
    return
  end
  local first, sum = frame(buffer)
  if not first then return garbage(tree, buffer, pinfo, sum) end
  data_telegram(tree, buffer, pinfo, state, first, sum)
end

DissectorTable.get("wtap_encap"):add(wtap.USER0, proto)
