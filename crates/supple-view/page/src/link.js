// Connection to the server by the Foxglove WebSocket protocol: one channel of frames, one service for commands.

const SUBPROTOCOL = "foxglove.websocket.v1";
const CHANNEL = "/view";
const SERVICE = "/request";
const RETRY_MS = 1000;

export class Link {
  constructor(url, { onFrame, onState }) {
    this.url = url;
    this.onFrame = onFrame;
    this.onState = onState;
    this.calls = new Map();
    this.nextCall = 1;
    this.service = null;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.url, [SUBPROTOCOL]);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) =>
      typeof data === "string" ? this.text(JSON.parse(data)) : this.binary(new DataView(data));
    socket.onclose = () => {
      this.service = null;
      for (const { reject } of this.calls.values()) reject(new Error("the viewer has ended"));
      this.calls.clear();
      this.onState("closed");
      setTimeout(() => this.connect(), RETRY_MS);
    };
    this.socket = socket;
  }

  text(message) {
    if (message.op === "serverInfo") this.onState("open");
    if (message.op === "advertise") {
      const channel = message.channels.find(({ topic }) => topic === CHANNEL);
      if (channel) this.send({ op: "subscribe", subscriptions: [{ id: 1, channelId: channel.id }] });
    }
    if (message.op === "advertiseServices") {
      this.service = message.services.find(({ name }) => name === SERVICE)?.id ?? null;
    }
    if (message.op === "serviceCallFailure") {
      this.settle(message.callId)?.reject(new Error(message.message));
    }
  }

  binary(view) {
    const rest = (from) => new TextDecoder().decode(new Uint8Array(view.buffer, from));
    if (view.getUint8(0) === 1) this.onFrame(JSON.parse(rest(13)));
    if (view.getUint8(0) === 3) {
      const length = view.getUint32(9, true);
      const answer = JSON.parse(rest(13 + length));
      this.settle(view.getUint32(5, true))?.resolve(answer);
    }
  }

  settle(id) {
    const call = this.calls.get(id);
    this.calls.delete(id);
    return call;
  }

  send(message) {
    this.socket.send(JSON.stringify(message));
  }

  /** Sends a command; the promise is fulfilled with the reply or rejected with the reason. */
  call(command) {
    if (this.service === null) return Promise.reject(new Error("not connected"));
    const encoding = new TextEncoder().encode("json");
    const payload = new TextEncoder().encode(JSON.stringify(command));
    const bytes = new Uint8Array(13 + encoding.length + payload.length);
    const view = new DataView(bytes.buffer);
    const id = this.nextCall++;
    view.setUint8(0, 2);
    view.setUint32(1, this.service, true);
    view.setUint32(5, id, true);
    view.setUint32(9, encoding.length, true);
    bytes.set(encoding, 13);
    bytes.set(payload, 13 + encoding.length);
    this.socket.send(bytes);
    return new Promise((resolve, reject) => this.calls.set(id, { resolve, reject }));
  }
}
